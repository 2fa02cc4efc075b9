"""Exact areas and first moments of polygons in the cells of a grid.

The signed-area accumulation of font rasterisers: each edge, cut where it crosses the grid's lines,
adds to its cell what lies to its right there, and to all cells further right its height; a running
sum along the rows does the rest. No sampling: the result is exact to rounding and continuous in the
vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Ints = npt.NDArray[np.int64]


def coverage(start: Floats, stop: Floats, weights: Floats, size: tuple[int, int]) -> Floats:
    """(3, channels, rows, columns): area, y moment and x moment, of a flat field, in each cell; see `changes`."""
    fields = changes(start, stop, weights, [size], np.array([len(start)]))[0]
    return np.concatenate([np.cumsum(fields[:2], axis=3), fields[2:]])


def as_changes(fields: Floats) -> Floats:
    """What `coverage` gives, as `changes` gives it."""
    return np.concatenate([np.diff(fields[:2], axis=3, prepend=0.0), fields[2:]])


def changes(
    start: Floats, stop: Floats, weights: Floats, sizes: Sequence[tuple[int, int]], counts: Ints
) -> list[Floats]:
    """What area and y moment of a flat field change by from cell to cell along rows, and the x moment in each cell:
    (3, channels, rows, columns) of each of several grids.

    start, stop  (n, 2) x, y of the ends of edges; cell (j, i) covers [i, i+1] x [j, j+1]. Outlines run
                 clockwise as seen with y down (positive area)
    weights      (n, channels) what the field gains from an edge's outer to its inner side; for one
                 polygon of value 1, ones
    sizes        (rows, columns) of each grid;  counts  how many of the edges, in order, are on each
    Moments are about the cell's middle, in cells. What lies outside the grid is cut off.
    """
    rows, columns = np.repeat(np.array(sizes).T, counts, axis=1)
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
    bases = [0, *accumulate(planes)]
    cell = (row * (columns[edge] + 1) + column).astype(np.int64) + np.repeat(bases[:-1], counts)[edge]
    plane, channels = bases[-1], weights.shape[1]
    moment = channels * plane
    places = np.array([0, 1, moment, moment + 1, 2 * moment])[:, None] + cell
    sums = np.bincount(
        (plane * np.arange(channels)[:, None, None] + places).ravel(),
        (weights.T.take(edge, axis=1)[:, None] * values).ravel(),
        minlength=3 * moment,
    )
    fields = np.asarray(sums, np.float64).reshape(3, channels, plane)
    return [
        fields[..., base : base + count].reshape(3, channels, rows, columns + 1)[..., :-1]
        for base, count, (rows, columns) in zip(bases, planes, sizes, strict=False)
    ]


def pieces(count: int, cut_edges: Ints, cut_places: Floats) -> tuple[Ints, Floats, Floats]:
    """Edges 0 .. count-1 cut at places 0..1 along them: (edge, begin, end) of each piece."""
    order = np.argsort(2 * cut_edges + cut_places, kind="stable")  # these are a few runs already: six times as fast
    places, edges = cut_places[order], np.arange(count)
    cuts = np.bincount(cut_edges, minlength=count)
    behind_cut = np.ones(count + len(places), dtype=bool)
    behind_cut[np.cumsum(cuts) - cuts + edges] = False  # the first piece of each edge
    begin, end = np.zeros(len(behind_cut)), np.ones(len(behind_cut))
    begin[behind_cut] = end[:-1][behind_cut[1:]] = places
    return np.repeat(edges, cuts + 1), begin, end


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


def centroids(start: Floats, stop: Floats, weights: Floats, counts: Ints) -> tuple[Floats, Floats]:
    """Integrals (grids, channels) and centroids (grids, channels, 2) of flat fields, see `changes`, by Green's theorem.

    counts  how many of the edges, in order, are on each grid
    A centroid is nan where the integral is 0.
    """
    some, shape = np.flatnonzero(counts), (len(counts), weights.shape[1])
    first = (np.cumsum(counts) - counts)[some]
    origin, integral, moment = np.zeros((len(counts), 2)), np.zeros(shape), np.zeros((*shape, 2))
    origin[some] = start[first]
    reference = np.repeat(origin, counts, axis=0)
    a, b = start - reference, stop - reference
    twice = weights * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[:, None]
    integral[some] = np.add.reduceat(twice, first) / 2
    moment[some] = np.add.reduceat(twice[:, :, None] * (a + b)[:, None], first)
    with np.errstate(divide="ignore", invalid="ignore"):
        return integral, origin[:, None] + moment / (6 * integral[..., None])
