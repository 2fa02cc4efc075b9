"""Polygons to a sprite: exact areas on a fine grid, blurred and binned to pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels
from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import centroids, changes
from irsim.geometry.product import product
from irsim.geometry.sprite import Sprite
from irsim.geometry.visible_edges import visible_edges
from irsim.physics.psf import PSF
from irsim.types import Box, Floats

Ints = npt.NDArray[np.int64]

FINENESS = ((16.0, 4), (100.0, 2), (math.inf, 1))
"""Cells of the fine grid to a pixel, on each axis, for what is no wider or higher than so many px. With two of them
alpha is within 0.0012 of the exact convolution at a blur of 0.6 px, and within 0.006 at 0.3 px. What is small has twice
as many, which costs little: its light then follows a shift smoothly enough for derivatives. What is large is drawn on
the pixels themselves, to bound the cost: within 0.015 and 0.046."""


class Outline(NamedTuple):
    """Convex polygons that hide each other.

    edges    start (n, 2), stop (n, 2) px from `origin` and layer (n,) of their outlines, see `visible_edges`
    glow     (layers,) radiance of each layer, W/m2/sr, the nearest layer first
    box      tight box of the geometry
    window   what of it is drawn (`box` itself, or a part)
    origin   (x, y) px
    """

    edges: tuple[Floats, Floats, Ints]
    glow: Floats
    box: Box
    window: Box
    psf: PSF
    range_m: float
    origin: tuple[float, float] = (0.0, 0.0)


def sprites(outlines: Sequence[Outline]) -> list[Sprite]:
    """Draw things, each alone; several at once take little longer than one.

    Each cell's light is spread as its exact area and first moments say, so that pixels follow a shift
    of a hundredth of a pixel.
    """
    if COMPILED:
        return [_sprite(outline) for outline in outlines]
    if not outlines:
        return []
    layers = tuple(len(outline.glow) for outline in outlines)
    bases = accumulate(layers, initial=0)
    start, stop = (np.concatenate([outline.edges[end] for outline in outlines]) for end in (0, 1))
    layer = np.concatenate([outline.edges[2] + base for outline, base in zip(outlines, bases, strict=False)])
    glow = np.concatenate([outline.glow for outline in outlines])
    start, stop, weights, layer = visible_edges(start, stop, layer, glow, layers)
    grids = [Grid.over(outline.window) for outline in outlines]
    counts = np.bincount(np.repeat(np.arange(len(outlines)), layers)[layer], minlength=len(outlines))
    corner = np.repeat(
        [grid.corner - outline.origin for grid, outline in zip(grids, outlines, strict=True)], counts, axis=0
    )
    fine = np.repeat([grid.fine for grid in grids], counts)[:, None]
    cells = [grid.cells for grid in grids]
    fields = changes((start - corner) * fine, (stop - corner) * fine, weights, cells, counts)
    integrals, centers = centroids(start, stop, weights, counts)
    drawn = []
    for outline, grid, field, (area, light), (center, signal_center) in zip(
        outlines, grids, fields, integrals.tolist(), centers, strict=True
    ):
        places = center + outline.origin, (signal_center if light > 0 else center) + outline.origin
        drawn.append(spread(grid, field, places, area, outline.box, outline.psf, outline.range_m))
    return drawn


def sprite(outline: Outline) -> Sprite:
    """Draw one thing."""
    return sprites([outline])[0]


def _sprite(outline: Outline) -> Sprite:
    """What `sprites` does, compiled."""
    grid, (left, top), margin = Grid.over(outline.window), outline.origin, outline.psf.support_px
    light = np.empty((3, grid.rows + 2 * margin, grid.columns + 2 * margin))
    area, signal, x, y, signal_x, signal_y = kernels.sprite_light(
        *outline.edges,
        outline.glow,
        grid.left - 0.5 - left,
        grid.top - 0.5 - top,
        grid.rows,
        grid.columns,
        spread_table(outline.psf, grid.fine),
        light,
    )
    return Sprite(
        x0=grid.left - margin,
        y0=grid.top - margin,
        cover=light[0],
        alpha=light[1],
        emission=light[2],
        center=(left + x, top + y),
        signal_center=(left + signal_x, top + signal_y) if signal > 0 else (left + x, top + y),
        box=outline.box,
        range_m=outline.range_m,
        area=area,
    )


@lru_cache(maxsize=32)
def spread_table(psf: PSF, fine: int) -> kernels.Spread:
    """A spread as compiled loops take it."""
    terms = psf.separable_kernels(fine)
    weights = np.array([weight / fine**2 for weight, _, _ in terms])
    return kernels.spread(weights, np.array([shares for _, *shares in terms]), fine)


class Grid(NamedTuple):
    """Cells that things are drawn on: left, top pixel; columns, rows of pixels; fine cells to a pixel."""

    left: int
    top: int
    columns: int
    rows: int
    fine: int

    @classmethod
    def over(cls, window: Box) -> Grid:
        """The grid that holds a window."""
        west, north, east, south = window.edges
        left, top = math.floor(west + 0.5), math.floor(north + 0.5)
        columns, rows = max(math.ceil(east - 0.5) - left + 1, 1), max(math.ceil(south - 0.5) - top + 1, 1)
        side = max(window.w, window.h)
        fine = next((fine for limit, fine in FINENESS if side <= limit), 1)
        return cls(left, top, columns, rows, fine)

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
    psf: PSF,
    range_m: float,
) -> Sprite:
    """A sprite of (opacity, glow) in the cells of a grid, (3, 2, rows, columns) as `changes` gives them.

    centers  area centroid and signal centroid;  whole_area  px2, off the grid too
    """
    center, signal_center = centers
    rows, columns, fine = grid.rows, grid.columns, grid.fine
    margin = psf.support_px
    light = np.zeros((2, rows + 2 * margin, columns + 2 * margin))
    for (down, down_slope), (across, across_slope) in zip(
        _down(psf, rows, fine), _across(psf, columns, fine), strict=True
    ):
        rising = product(down, fields[0]) + product(down_slope, fields[1])
        light += product(rising, across) + product(product(down, fields[2]), across_slope)
    cover = np.zeros(light.shape[1:])
    covered = np.cumsum(fields[0, 0].reshape(rows, fine, -1).sum(axis=1), axis=1).reshape(rows, columns, fine)
    cover[margin : margin + rows, margin : margin + columns] = covered.sum(axis=2) / fine**2
    return Sprite(
        x0=grid.left - margin,
        y0=grid.top - margin,
        cover=cover,
        alpha=light[0],
        emission=light[1],
        center=(float(center[0]), float(center[1])),
        signal_center=(float(signal_center[0]), float(signal_center[1])),
        box=box,
        range_m=range_m,
        area=whole_area,
    )


Pair = tuple[Floats, Floats]


@lru_cache(maxsize=64)
def _down(psf: PSF, pixels: int, fine: int) -> tuple[Pair, ...]:
    """Of each term of a spread two (pixels + 2 reach, pixels * fine) matrices, for light that fills cells evenly and
    for their first moments. Read only."""

    def matrix(shares: Floats) -> Floats:
        reached = shares.shape[1]
        whole = np.zeros((pixels + reached - 1, pixels, fine))
        for pixel in range(pixels):
            whole[pixel : pixel + reached, pixel] = shares.T
        return _frozen(whole.reshape(-1, pixels * fine))

    return tuple((matrix(even), matrix(slope)) for _, even, slope in psf.separable_kernels(fine))


@lru_cache(maxsize=32)
def _across(psf: PSF, pixels: int, fine: int) -> tuple[Pair, ...]:
    """Of each term of a spread, weighted, two (pixels * fine, pixels + 2 reach) matrices along rows: for what changes
    from cell to cell, which counts in all cells further right too, and for x moments. Read only."""
    weights = [weight / fine**2 for weight, _, _ in psf.separable_kernels(fine)]
    return tuple(
        (
            _frozen(np.ascontiguousarray(np.cumsum(right[:, ::-1], axis=1)[:, ::-1].T) * weight),
            _frozen(np.ascontiguousarray(right_slope.T) * weight),
        )
        for weight, (right, right_slope) in zip(weights, _down(psf, pixels, fine), strict=True)
    )


def _frozen(matrix: Floats) -> Floats:
    matrix.flags.writeable = False
    return matrix


def drawn_part(box: Box, context: SceneContext) -> Box:
    """The part of a box whose light can reach the frame; a corner of it where none can."""
    return within_sight(box, context) or Box(box.left, box.top, 1.0, 1.0)


def within_sight(box: Box, context: SceneContext) -> Box | None:
    """The part of a box whose light can reach the frame; None where none can."""
    reach, (columns, rows), (west, north, east, south) = context.psf.support_px + 0.5, context.geometry.size, box.edges
    right, bottom = columns - 1 + reach, rows - 1 + reach
    if -reach <= west < east <= right and -reach <= north < south <= bottom:
        return box
    west, north, east, south = max(west, -reach), max(north, -reach), min(east, right), min(south, bottom)
    return Box.from_edges(west, north, east, south) if west < east and north < south else None
