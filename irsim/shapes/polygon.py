"""Exact area coverage of polygons on a grid of cells.

The signed-area accumulation of font rasterisers: each edge, cut where it crosses the grid's lines,
adds to its cell the area to its right, and to all cells further right its height; a running sum
along the rows does the rest. No sampling: the result is exact to rounding and continuous in the
vertices.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from irsim.types import Floats


def coverage(start: Floats, stop: Floats, layer: npt.NDArray[np.integer], size: tuple[int, int, int]) -> Floats:
    """(layers, rows, columns): the area share of each cell inside the polygons of each layer.

    start, stop  (n, 2) x, y of the edges' ends; cell (j, i) covers [i, i+1] x [j, j+1]. The edges of
                 a layer close one or more outlines, clockwise as seen with y down (positive area)
    layer        (n,) the layer of each edge
    What lies outside the grid is cut off.
    """
    layers, rows, columns = size
    delta = stop - start
    first, at_y = _crossings(start[:, 1], stop[:, 1], rows)
    second, at_x = _crossings(start[:, 0], stop[:, 0], columns)
    count = len(start)
    edge = np.concatenate([np.arange(count), first, second, np.arange(count)])
    place = np.concatenate([np.zeros(count), at_y, at_x, np.ones(count)])
    order = np.argsort(2 * edge + place)
    edge, place = edge[order], place[order]
    inner = edge[1:] == edge[:-1]
    edge, begin, end = edge[1:][inner], place[:-1][inner], place[1:][inner]

    middle = start[edge] + delta[edge] * ((begin + end) / 2)[:, None]
    height = delta[edge, 1] * (end - begin)
    column, row = np.floor(middle[:, 0]), np.floor(middle[:, 1])
    # Left of the grid an edge still bounds all the cells to its right; right of it, none.
    column = np.clip(column, 0, columns)
    share = np.clip(middle[:, 0] - column, 0.0, 1.0)
    seen = (row >= 0) & (row < rows) & (column < columns)
    width = columns + 1
    cell = ((layer[edge] * rows + row) * width + column)[seen].astype(np.int64)
    height, share = height[seen], share[seen]
    deltas = np.bincount(
        np.concatenate([cell, cell + 1]),
        np.concatenate([height * share - height, -height * share]),
        minlength=layers * rows * width,
    )
    # The last column only takes what spills to the right of the grid.
    areas = np.cumsum(deltas.reshape(layers, rows, width), axis=2)[:, :, :columns]
    return np.asarray(areas)


def _crossings(low: Floats, high: Floats, lines: int) -> tuple[npt.NDArray[np.int64], Floats]:
    """Where edges between two coordinates cross the grid's lines 0 .. lines: edge numbers and places 0..1."""
    smaller, larger = np.minimum(low, high), np.maximum(low, high)
    first = np.maximum(np.floor(smaller) + 1, 0)
    last = np.minimum(np.ceil(larger) - 1, lines)
    counts = np.maximum(last - first + 1, 0).astype(np.int64)
    edge = np.repeat(np.arange(len(low)), counts)
    ordinal = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    return edge, (first[edge] + ordinal - low[edge]) / (high[edge] - low[edge])


def outline(points: Floats) -> tuple[Floats, Floats]:
    """(start, stop) of the edges of one polygon (n, 2), turned so that its area is positive."""
    following = np.roll(points, -1, axis=0)
    area = np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0])
    return (points, following) if area >= 0 else (following, points)
