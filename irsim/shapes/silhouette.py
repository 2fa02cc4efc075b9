"""Polygons in layers, composited and blurred: the last step of drawing any body."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from irsim.optics import reach_px, spreading
from irsim.shapes.polygon import coverage
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Box, Floats

FINE = 3
"""Cells of the fine grid to a pixel, on each axis."""
LARGE_PX = 100.0
"""Bodies wider or higher than this are drawn on the pixels themselves, to bound the cost."""


def sprite(
    edges: tuple[Floats, Floats, npt.NDArray[np.integer]],
    glow: Floats,
    box: Box,
    window: Box,
    psf_px: float,
    range_m: float,
) -> Sprite:
    """Draw layers that hide each other.

    edges    start (n, 2), stop (n, 2) in px and layer (n,) of their outlines, see `coverage`
    glow     (layers,) radiance of each layer, W/m2/sr, the nearest layer first
    box      tight box of the geometry
    window   what of it is drawn (`box` itself, or a part)

    Each layer's exact coverage of a fine grid is composited under the nearer ones. Where the outlines
    of two layers cross or touch inside a cell, the cell's union is estimated as if they were
    independent, so parts of a body should overlap rather than abut.
    """
    fine = FINE if max(window.w, window.h) <= LARGE_PX else 1
    left, top = math.floor(window.left + 0.5), math.floor(window.top + 0.5)
    columns = max(math.ceil(window.right - 0.5) - left + 1, 1)
    rows = max(math.ceil(window.bottom - 0.5) - top + 1, 1)
    start, stop, layer = edges
    corner = np.array([left - 0.5, top - 0.5])
    inside = coverage(
        (start - corner) * fine, (stop - corner) * fine, layer, (len(glow), rows * fine, columns * fine)
    ).clip(0.0, 1.0)
    clear = np.ones(inside.shape[1:])
    light = np.zeros(inside.shape[1:])
    for covered, radiance in zip(inside, glow.tolist(), strict=True):
        covered *= clear
        clear -= covered
        light += covered * radiance
    whole = 1 - clear

    margin = reach_px(psf_px)
    down = spreading(rows, margin, fine, psf_px)
    across = spreading(columns, margin, fine, psf_px).T
    alpha = down @ whole @ across / fine**2
    cover = np.zeros_like(alpha)
    cover[margin : margin + rows, margin : margin + columns] = whole.reshape(rows, fine, columns, fine).mean(
        axis=(1, 3)
    )
    return Sprite(
        x0=left - margin,
        y0=top - margin,
        cover=cover,
        alpha=alpha,
        emission=down @ light @ across / fine**2,
        center=_centroid(whole, left, top, fine),
        signal_center=_centroid(light, left, top, fine),
        box=box,
        range_m=range_m,
    )


def within_sight(box: Box, stage: Stage) -> Box | None:
    """The part of a box whose light can reach the frame; None where none can."""
    reach = reach_px(stage.psf_px)
    columns, rows = stage.geometry.size
    left, top = max(box.left, -0.5 - reach), max(box.top, -0.5 - reach)
    right, bottom = min(box.right, columns - 0.5 + reach), min(box.bottom, rows - 0.5 + reach)
    return Box.from_edges(left, top, right, bottom) if left < right and top < bottom else None


def _centroid(cells: Floats, left: int, top: int, fine: int) -> tuple[float, float]:
    """(x, y) px of a fine grid whose first pixel is (left, top); its middle where it is empty."""
    rows, columns = cells.shape
    by_row, by_column = cells.sum(axis=1), cells.sum(axis=0)
    total = by_row.sum()
    x = float(by_column @ np.arange(columns) / total) if total > 0 else (columns - 1) / 2
    y = float(by_row @ np.arange(rows) / total) if total > 0 else (rows - 1) / 2
    return left - 0.5 + (x + 0.5) / fine, top - 0.5 + (y + 0.5) / fine
