"""Exact areas and first moments of polygons in the cells of a grid.

The signed-area accumulation of font rasterisers: each edge, cut where it crosses the grid's lines,
adds to its cell what lies to its right there, and to all cells further right its height; a running
sum along the rows does the rest. No sampling: the result is exact to rounding and continuous in the
vertices.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Ints = npt.NDArray[np.int64]


def coverage(start: Floats, stop: Floats, weights: Floats, size: tuple[int, int]) -> Floats:
    """(3, channels, rows, columns): area, y moment and x moment, of a flat field, in each cell; see `coverages`."""
    return coverages(start, stop, weights, [size], [len(start)])[0]


def coverages(
    start: Floats, stop: Floats, weights: Floats, sizes: Sequence[tuple[int, int]], counts: Sequence[int]
) -> list[Floats]:
    """Area, y moment and x moment of a flat field in each cell: (3, channels, rows, columns) of each of several grids.

    start, stop  (n, 2) x, y of the ends of edges; cell (j, i) covers [i, i+1] x [j, j+1]. Outlines run
                 clockwise as seen with y down (positive area)
    weights      (n, channels) what the field gains from an edge's outer to its inner side; for one
                 polygon of value 1, ones
    sizes        (rows, columns) of each grid;  counts  how many of the edges, in order, are on each
    Moments are about the cell's middle, in cells. What lies outside the grid is cut off.
    """
    rows, columns = (np.repeat(side, counts) for side in zip(*sizes, strict=True))
    (x0, y0), (dx, dy) = np.ascontiguousarray(start.T), np.ascontiguousarray((stop - start).T)
    edge, begin, end = pieces(len(start), *_crossings(start, stop, columns, rows))

    at, length = (begin + end) / 2, end - begin
    wide, high = dx[edge], dy[edge]
    x, y = x0[edge] + wide * at, y0[edge] + high * at  # the middle
    column, row = np.floor(x), np.floor(y)
    seen = np.flatnonzero((row >= 0) & (row < rows[edge]) & (column < columns[edge]))
    edge = edge[seen]
    x, y, column, row, length, wide, high = (part[seen] for part in (x, y, column, row, length, wide, high))
    wide *= length
    high *= length
    # Left of the grid an edge still bounds all the cells to its right, like an edge on the border.
    off = column < 0
    column[off] = wide[off] = x[off] = 0.0
    x -= column
    y -= row + 0.5

    # Of the cell: what is right of the piece. Of its neighbour: what the cell lacks to a whole one.
    area = -high * (1 - x)
    x_moment = -high * (0.125 - ((x - 0.5) ** 2 + wide**2 / 12) / 2)
    y_moment = area * y + high * wide * high / 12
    values = np.stack([area, -high - area, y_moment, -high * y - y_moment, x_moment])
    planes = [high * (wide + 1) for high, wide in sizes]  # the last column takes what spills over to the right
    bases = np.cumsum(planes) - planes
    cell = (row * (columns[edge] + 1) + column).astype(np.int64) + np.repeat(bases, counts)[edge]
    plane, channels = sum(planes), weights.shape[1]
    moment = channels * plane
    places = np.add.outer([0, 1, moment, moment + 1, 2 * moment], cell)
    sums = np.bincount(
        np.add.outer(plane * np.arange(channels), places).ravel(),
        (weights.T.take(edge, axis=1)[:, None] * values).ravel(),
        minlength=3 * moment,
    )
    parts = np.split(np.asarray(sums, np.float64).reshape(3, channels, plane), bases[1:], axis=2)
    return [_summed(part, *size) for part, size in zip(parts, sizes, strict=True)]


def _summed(changes: Floats, rows: int, columns: int) -> Floats:
    """Areas and moments of a grid, of what they change by from cell to cell along rows of one cell more."""
    sums = changes.reshape(3, -1, rows, columns + 1)
    np.cumsum(sums[:2], axis=3, out=sums[:2])
    return np.asarray(sums[..., :columns])


def pieces(count: int, cut_edges: Ints, cut_places: Floats) -> tuple[Ints, Floats, Floats]:
    """Edges 0 .. count-1 cut at places 0..1 along them: (edge, begin, end) of each piece."""
    whole = np.arange(count)
    edge = np.concatenate([whole, cut_edges, whole])
    place = np.concatenate([np.zeros(count), cut_places, np.ones(count)])
    order = np.argsort(2 * edge + place, kind="stable")  # these are a few runs already: six times as fast
    edge, place = edge[order], place[order]
    inner = edge[1:] == edge[:-1]
    return edge[1:][inner], place[:-1][inner], place[1:][inner]


def _crossings(start: Floats, stop: Floats, columns: Ints, rows: Ints) -> tuple[Ints, Floats]:
    """Where edges cross the lines of their grids of so many columns and rows: edge numbers and places 0..1."""
    low, high = start.T.ravel(), stop.T.ravel()  # all x, then all y
    last_line = np.concatenate([columns, rows])
    first = np.maximum(np.floor(np.minimum(low, high)) + 1, 0)
    last = np.minimum(np.ceil(np.maximum(low, high)) - 1, last_line)
    counts = np.maximum(last - first + 1, 0).astype(np.int64)
    edge = np.repeat(np.arange(len(low)), counts)
    ordinal = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    return edge % len(start), (first[edge] + ordinal - low[edge]) / (high[edge] - low[edge])


def outline(points: Floats) -> tuple[Floats, Floats]:
    """(start, stop) of the edges of one polygon (n, 2), turned so that its area is positive."""
    following = np.roll(points, -1, axis=0)
    area = np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0])
    return (points, following) if area >= 0 else (following, points)


def centroids(start: Floats, stop: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Integral (channels,) and centroid (channels, 2) of flat fields, see `coverage`, by Green's theorem.

    The centroid is nan where the integral is 0.
    """
    origin = start[0]
    a, b = start - origin, stop - origin
    twice = weights.T * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    integral = twice.sum(axis=1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return integral, origin + twice @ (a + b) / (6 * integral[:, None])
