"""Exact areas and first moments of polygons in the cells of a grid.

The signed-area accumulation of font rasterisers: each edge, cut where it crosses the grid's lines,
adds to its cell what lies to its right there, and to all cells further right its height; a running
sum along the rows does the rest. No sampling: the result is exact to rounding and continuous in the
vertices.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from irsim.types import Floats


def coverage(start: Floats, stop: Floats, weights: Floats, size: tuple[int, int]) -> Floats:
    """(3, channels, rows, columns): area, y moment and x moment, of a flat field, in each cell.

    start, stop  (n, 2) x, y of the ends of edges; cell (j, i) covers [i, i+1] x [j, j+1]. Outlines run
                 clockwise as seen with y down (positive area)
    weights      (n, channels) what the field gains from an edge's outer to its inner side; for one
                 polygon of value 1, ones
    Moments are about the cell's middle, in cells. What lies outside the grid is cut off.
    """
    rows, columns = size
    delta = stop - start
    edge, begin, end = pieces(len(start), *_crossings(start, stop, columns, rows))

    middle = start[edge] + delta[edge] * ((begin + end) / 2)[:, None]
    corner = np.floor(middle)
    seen = (corner[:, 1] >= 0) & (corner[:, 1] < rows) & (corner[:, 0] < columns)
    edge, middle, corner, length = edge[seen], middle[seen], corner[seen], (end - begin)[seen]
    wide, high = (delta[edge] * length[:, None]).T
    # Left of the grid an edge still bounds all the cells to its right, like an edge on the border.
    off = corner[:, 0] < 0
    column, row = np.where(off, 0.0, corner[:, 0]), corner[:, 1]
    wide = np.where(off, 0.0, wide)
    x = np.where(off, 0.0, middle[:, 0] - column)
    y = middle[:, 1] - row - 0.5

    # Of the cell: what is right of the piece. Of its neighbour: what the cell lacks to a whole one.
    area = -high * (1 - x)
    x_moment = -high * (0.125 - ((x - 0.5) ** 2 + wide**2 / 12) / 2)
    y_moment = area * y + high * wide * high / 12
    values = np.stack([area, -high - area, y_moment, -high * y - y_moment, x_moment])
    width = columns + 1  # the last column takes what spills over to the right
    cell = (row * width + column).astype(np.int64)
    plane = rows * width
    channels = weights.shape[1]
    moment = channels * plane
    places = np.add.outer([0, 1, moment, moment + 1, 2 * moment], cell)
    sums = np.bincount(
        np.add.outer(plane * np.arange(channels), places).ravel(),
        (weights[edge].T[:, None, :] * values).ravel(),
        minlength=3 * moment,
    ).reshape(3, channels, rows, width)
    np.cumsum(sums[:2], axis=3, out=sums[:2])
    return np.asarray(sums[..., :columns])


def pieces(
    count: int, cut_edges: npt.NDArray[np.int64], cut_places: Floats
) -> tuple[npt.NDArray[np.int64], Floats, Floats]:
    """Edges 0 .. count-1 cut at places 0..1 along them: (edge, begin, end) of each piece."""
    whole = np.arange(count)
    edge = np.concatenate([whole, cut_edges, whole])
    place = np.concatenate([np.zeros(count), cut_places, np.ones(count)])
    order = np.argsort(2 * edge + place)
    edge, place = edge[order], place[order]
    inner = edge[1:] == edge[:-1]
    return edge[1:][inner], place[:-1][inner], place[1:][inner]


def _crossings(start: Floats, stop: Floats, columns: int, rows: int) -> tuple[npt.NDArray[np.int64], Floats]:
    """Where edges cross the grid's lines: edge numbers and places 0..1."""
    low, high = start.T.ravel(), stop.T.ravel()  # all x, then all y
    last_line = np.repeat([columns, rows], len(start))
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
