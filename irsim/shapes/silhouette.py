"""Polygons to a sprite: exact areas on a fine grid, blurred and binned to pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.optics import PointSpread
from irsim.shapes.polygon import centroids, coverages
from irsim.shapes.visible import visible_edges
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Box, Floats

FINE = 2
"""Cells of the fine grid to a pixel, on each axis: alpha is within 0.0012 of the exact convolution at a
blur of 0.6 px, and within 0.006 at 0.3 px."""
SMALL_PX = 16.0
"""What is no wider or higher than this has twice as many, which costs little: its light then follows a shift
smoothly enough for derivatives."""
LARGE_PX = 100.0
"""What is wider or higher than this is drawn on the pixels themselves, to bound the cost: within 0.015
and 0.046."""


@dataclass(frozen=True, eq=False)
class Outline:
    """Convex polygons that hide each other.

    edges    start (n, 2), stop (n, 2) px and layer (n,) of their outlines, see `visible_edges`
    glow     (layers,) radiance of each layer, W/m2/sr, the nearest layer first
    box      tight box of the geometry
    window   what of it is drawn (`box` itself, or a part)
    """

    edges: tuple[Floats, Floats, npt.NDArray[np.int64]]
    glow: Floats
    box: Box
    window: Box
    psf: PointSpread
    range_m: float


def sprites(outlines: Sequence[Outline]) -> list[Sprite]:
    """Draw things, each alone; several at once take little longer than one.

    Each cell's light is spread as its exact area and first moments say, so that pixels follow a shift
    of a hundredth of a pixel.
    """
    if not outlines:
        return []
    layers = tuple(len(outline.glow) for outline in outlines)
    bases = np.cumsum(layers) - layers
    start, stop = (np.concatenate([outline.edges[end] for outline in outlines]) for end in (0, 1))
    layer = np.concatenate([outline.edges[2] + base for outline, base in zip(outlines, bases, strict=True)])
    glow = np.concatenate([outline.glow for outline in outlines])
    start, stop, weights, layer = visible_edges(start, stop, layer, glow, layers)
    grids = [Grid.over(outline.window) for outline in outlines]
    first = np.searchsorted(layer, bases)
    counts = np.diff(np.append(first, len(layer)))
    corner = np.repeat([grid.corner for grid in grids], counts, axis=0)
    fine = np.repeat([grid.fine for grid in grids], counts)[:, None]
    cells = [grid.cells for grid in grids]
    fields = coverages((start - corner) * fine, (stop - corner) * fine, weights, cells, counts.tolist())
    drawn = []
    for outline, grid, field, begin, count in zip(outlines, grids, fields, first, counts, strict=True):
        own = slice(begin, begin + count)
        (area, light), (center, signal_center) = centroids(start[own], stop[own], weights[own])
        if not light > 0:
            signal_center = center
        places = center, signal_center
        drawn.append(spread(grid, field, places, float(area), outline.box, outline.psf, outline.range_m))
    return drawn


def sprite(outline: Outline) -> Sprite:
    """Draw one thing."""
    return sprites([outline])[0]


@dataclass(frozen=True)
class Grid:
    """Cells that things are drawn on: left, top pixel; columns, rows of pixels; fine cells to a pixel."""

    left: int
    top: int
    columns: int
    rows: int
    fine: int

    @classmethod
    def over(cls, window: Box) -> Grid:
        """The grid that holds a window."""
        left, top = math.floor(window.left + 0.5), math.floor(window.top + 0.5)
        columns = max(math.ceil(window.right - 0.5) - left + 1, 1)
        rows = max(math.ceil(window.bottom - 0.5) - top + 1, 1)
        side = max(window.w, window.h)
        return cls(left, top, columns, rows, 2 * FINE if side <= SMALL_PX else FINE if side <= LARGE_PX else 1)

    @property
    def corner(self) -> Floats:
        """(2,) px: its outer corner."""
        return np.array([self.left - 0.5, self.top - 0.5])

    @property
    def cells(self) -> tuple[int, int]:
        """(rows, columns) of cells."""
        return self.rows * self.fine, self.columns * self.fine


def spread(
    grid: Grid,
    fields: Floats,
    centers: tuple[Floats, Floats],
    whole_area: float,
    box: Box,
    psf: PointSpread,
    range_m: float,
) -> Sprite:
    """A sprite of areas and moments (3, 2, rows, columns) of (opacity, glow) in the cells of a grid, see `coverage`.

    centers  area centroid and signal centroid;  whole_area  px2, off the grid too
    """
    center, signal_center = centers
    (area, y_moment, x_moment), rows, columns, fine = fields, grid.rows, grid.columns, grid.fine
    margin = psf.reach_px
    alpha, emission = np.zeros((2, rows + 2 * margin, columns + 2 * margin))
    for (weight, down, down_slope), (_, right, right_slope) in zip(
        psf.spreading(rows, fine), psf.spreading(columns, fine), strict=True
    ):
        across, across_slope = right.T * (weight / fine**2), right_slope.T * (weight / fine**2)
        part = down @ (area @ across + x_moment @ across_slope) + down_slope @ (y_moment @ across)
        alpha += part[0]
        emission += part[1]
    cover = np.zeros_like(alpha)
    cover[margin : margin + rows, margin : margin + columns] = (
        sum(area[0, i::fine, j::fine] for i in range(fine) for j in range(fine)) / fine**2
    )
    return Sprite(
        x0=grid.left - margin,
        y0=grid.top - margin,
        cover=cover,
        alpha=alpha,
        emission=emission,
        center=(float(center[0]), float(center[1])),
        signal_center=(float(signal_center[0]), float(signal_center[1])),
        box=box,
        range_m=range_m,
        area=whole_area,
    )


def drawn_part(box: Box, stage: Stage) -> Box:
    """The part of a box whose light can reach the frame; a corner of it where none can."""
    return within_sight(box, stage) or Box(box.left, box.top, 1.0, 1.0)


def within_sight(box: Box, stage: Stage) -> Box | None:
    """The part of a box whose light can reach the frame; None where none can."""
    reach = stage.psf.reach_px
    columns, rows = stage.geometry.size
    left, top = max(box.left, -0.5 - reach), max(box.top, -0.5 - reach)
    right, bottom = min(box.right, columns - 0.5 + reach), min(box.bottom, rows - 0.5 + reach)
    return Box.from_edges(left, top, right, bottom) if left < right and top < bottom else None
