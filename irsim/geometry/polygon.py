"""Exact polygon coverage of grid cells, and hidden-line removal for convex polygons in depth order.

Coverage is the signed-area accumulation of font rasterisers: each edge, cut at the lines of the grid, adds to its cell
the area on its right within the cell, and to all cells further right its height; a running sum along the rows completes
the field. The result is exact to rounding and continuous in the vertices; nothing is sampled.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Ints = npt.NDArray[np.int64]

_INSET_PX = 1e-9
"""Inset of the edges of each layer relative to the layer in front. It separates coinciding edges of two layers, whose
order rounding would otherwise decide. Objects smaller than a pixel have a proportionally smaller inset, as the full one
would open visible gaps between their layers."""


def coverage(start: Floats, stop: Floats, weights: Floats, size: tuple[int, int]) -> Floats:
    """Return area, y and x moment (3, channels, rows, columns) of a piecewise constant field; see `row_differences`."""
    fields = row_differences(start, stop, weights, size)
    return np.concatenate([np.cumsum(fields[:2], axis=3), fields[2:]])


def as_row_differences(fields: Floats) -> Floats:
    """Return the fields of `coverage` in the form of `row_differences`."""
    return np.concatenate([np.diff(fields[:2], axis=3, prepend=0.0), fields[2:]])


def row_differences(start: Floats, stop: Floats, weights: Floats, size: tuple[int, int]) -> Floats:
    """Return the row-wise differences of area and y moment, and the x moment, (3, channels, rows, columns).

    start, stop  (n, 2) x, y of the ends of edges; cell (j, i) covers [i, i+1] x [j, j+1]. Outlines run clockwise as
                 seen with y down (positive area)
    weights      (n, channels) step of the field from an edge's outer to its inner side; 1 for each edge of a single
                 polygon of value 1
    size         (rows, columns) of the grid

    Moments are about the cell's middle, in cells. Parts outside the grid are cut off.
    """
    rows, columns = size
    (x0, y0), (dx, dy) = np.ascontiguousarray(start.T), np.ascontiguousarray((stop - start).T)
    edge, begin, end = cut_edges(len(start), *_crossings(start, stop, columns, rows))

    at, length = (begin + end) / 2, end - begin
    wide, high = dx[edge], dy[edge]
    x, y = x0[edge] + wide * at, y0[edge] + high * at  # midpoint
    column, row = np.floor(x), np.floor(y)
    seen = np.flatnonzero((row >= 0) & (row < rows) & (column < columns))
    edge = edge[seen]
    x, y, column, row, length, wide, high = (part[seen] for part in (x, y, column, row, length, wide, high))
    wide *= length
    high *= length
    # An edge left of the grid bounds all cells to its right, like an edge on the border.
    off = column < 0
    column[off] = wide[off] = x[off] = 0.0
    x -= column
    y -= row + 0.5

    # The cell gets the area right of the piece, its right neighbour the remainder to a whole cell.
    area = -high * (1 - x)
    x_moment = -high * (0.125 - ((x - 0.5) ** 2 + wide**2 / 12) / 2)
    y_moment = area * y + high * wide * high / 12
    values = np.stack([area, -high - area, y_moment, -high * y - y_moment, x_moment])
    cell = (row * (columns + 1) + column).astype(np.int64)  # one extra column takes the overflow to the right
    plane, channels = rows * (columns + 1), weights.shape[1]
    moment = channels * plane
    places = np.array([0, 1, moment, moment + 1, 2 * moment])[:, None] + cell
    sums = np.bincount(
        (plane * np.arange(channels)[:, None, None] + places).ravel(),
        (weights.T.take(edge, axis=1)[:, None] * values).ravel(),
        minlength=3 * moment,
    )
    return np.asarray(sums, np.float64).reshape(3, channels, rows, columns + 1)[..., :-1]


def cut_edges(count: int, crossed: Ints, places_cut: Floats) -> tuple[Ints, Floats, Floats]:
    """Return (edge, begin, end) of the pieces of edges 0 .. count-1; `crossed` are cut at `places_cut`, 0..1 along
    them."""
    order = np.argsort(2 * crossed + places_cut, kind="stable")  # fast, as the input is a few sorted runs
    places, edges = places_cut[order], np.arange(count)
    cuts = np.bincount(crossed, minlength=count)
    behind_cut = np.ones(count + len(places), dtype=bool)
    behind_cut[np.cumsum(cuts) - cuts + edges] = False  # the first piece of each edge
    begin, end = np.zeros(len(behind_cut)), np.ones(len(behind_cut))
    begin[behind_cut] = end[:-1][behind_cut[1:]] = places
    return np.repeat(edges, cuts + 1), begin, end


def _crossings(start: Floats, stop: Floats, columns: int, rows: int) -> tuple[Ints, Floats]:
    """Return the crossings of edges with the grid's lines: the edge's number and the position 0..1 along it."""
    low, high = start.T.ravel(), stop.T.ravel()  # all x, then all y
    last_line = np.repeat([columns, rows], len(start))
    first = np.maximum(np.floor(np.minimum(low, high)) + 1, 0)
    last = np.minimum(np.ceil(np.maximum(low, high)) - 1, last_line)
    counts = np.maximum(last - first + 1, 0).astype(np.int64)
    edge = np.repeat(np.arange(len(low)), counts)
    ordinal = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    return edge % len(start), (first[edge] + ordinal - low[edge]) / (high[edge] - low[edge])


def polygon_edges(points: Floats) -> tuple[Floats, Floats]:
    """Return (start, stop) of the edges of one polygon (n, 2), oriented for positive area."""
    following = np.roll(points, -1, axis=0)
    area = np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0])
    return (points, following) if area >= 0 else (following, points)


def centroids(start: Floats, stop: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return integrals (channels,) and centroids (channels, 2) of piecewise constant fields by Green's theorem.

    Arguments as in `row_differences`. A centroid is nan where the integral is 0.
    """
    channels = weights.shape[1]
    if not len(start):
        return np.zeros(channels), np.full((channels, 2), np.nan)
    origin = start[0]
    a, b = start - origin, stop - origin
    twice = weights * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[:, None]
    integral = np.add.reduceat(twice, [0])[0] / 2
    moment = np.add.reduceat(twice[:, :, None] * (a + b)[:, None], [0])[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return integral, origin + moment / (6 * integral[:, None])


def visible_edges(start: Floats, stop: Floats, layer: Ints, glow: Floats) -> tuple[Floats, Floats, Floats]:
    """Return (start, stop, weights) of the visible pieces of edges of convex polygons in depth order.

    start, stop  (n, 2) px, edges clockwise as seen with y down, one convex polygon a layer
    layer        (n,) polygon of each edge, rising; layer 0 is the nearest
    glow         (layers,) radiance of each polygon

    The returned weights (pieces, 2) are the steps of (opacity, glow) across each piece. Between pieces the field is
    constant: an edge of polygon k is visible where no nearer polygon covers it, and separates k from the nearest of the
    farther polygons that cover it.
    """
    inset = _INSET_PX * min((start.max(axis=0) - start.min(axis=0)).max(), 1.0)
    delta = stop - start
    across, down = -delta[:, 1], delta[:, 0]
    length = np.maximum(np.sqrt(across * across + down * down), 1e-300)
    start = start + np.column_stack([across, down]) * (inset * layer / length)[:, None]
    stop = start + delta

    edge, polygon, entry, leave = _covered_spans(start, stop, layer, len(glow))
    count, nothing = len(start), len(glow)
    cut, begin, end = cut_edges(count, np.concatenate([edge, edge]), np.concatenate([entry, leave]))
    # For each piece, all polygons that cover a part of its edge.
    counts = np.bincount(edge, minlength=count)
    first, each = (np.cumsum(counts) - counts)[cut], counts[cut]
    which, middle = _ranges(first, each), np.repeat((begin + end) / 2, each)
    inside = np.where((entry[which] < middle) & (middle < leave[which]), polygon[which], nothing)
    nearest = np.full(len(cut), nothing)
    some = np.flatnonzero(each)
    if len(some):
        nearest[some] = np.minimum.reduceat(inside, (np.cumsum(each) - each)[some])
    own = layer[cut]
    bare = nearest == nothing
    gain = glow[own] - np.append(glow, 0.0)[nearest]
    seen = np.flatnonzero((begin < end) & (nearest > own) & (bare | (gain != 0)))
    cut, begin, end, bare, gain = cut[seen], begin[seen], end[seen], bare[seen], gain[seen]
    # Consecutive pieces with equal weights are joined.
    joined = (cut[1:] == cut[:-1]) & (begin[1:] == end[:-1]) & (bare[1:] == bare[:-1]) & (gain[1:] == gain[:-1])
    begins, ends = np.ones(len(cut), np.bool_), np.ones(len(cut), np.bool_)
    begins[1:], ends[:-1] = ~joined, ~joined
    heads, tails = np.flatnonzero(begins), np.flatnonzero(ends)
    cut = cut[heads]
    origin, along = start.take(cut, axis=0), delta.take(cut, axis=0)
    weights = np.stack([bare[heads], gain[heads]], axis=1)
    return origin + along * begin[heads, None], origin + along * end[tails, None], weights


def _covered_spans(start: Floats, stop: Floats, layer: Ints, count: int) -> tuple[Ints, Ints, Floats, Floats]:
    """Return (edge, polygon, entry, leave) of edges that run through other polygons.

    entry, leave  positions 0..1 along the edge. The result is sorted by edge and polygon; only pairs with overlapping
    bounding boxes are tested.
    """
    sides = np.bincount(layer, minlength=count)
    first = np.cumsum(sides) - sides
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    lows, highs = np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)
    meet = (lows[:, None, 0] <= highs[:, 0]) & (lows[:, None, 1] <= highs[:, 1])
    meet &= meet.T
    np.fill_diagonal(meet, False)
    mine, polygon = np.nonzero(meet)
    edge, polygon = _ranges(first[mine], sides[mine]), np.repeat(polygon, sides[mine])
    near = np.ones(len(edge), dtype=bool)
    for axis in (0, 1):
        near &= low[:, axis][edge] <= highs[:, axis][polygon]
        near &= high[:, axis][edge] >= lows[:, axis][polygon]
    edge, polygon = edge[near], polygon[near]
    order = np.argsort(edge, kind="stable")
    edge, polygon = edge[order], polygon[order]
    if not len(edge):
        return edge, polygon, np.zeros(0), np.zeros(0)

    # Signed distances of an edge's ends from each line of the polygon.
    lines = sides[polygon]
    line, at = _ranges(first[polygon], lines), np.repeat(edge, lines)
    delta = stop - start
    across, down = -delta[:, 1], delta[:, 0]
    level = across * start[:, 0] + down * start[:, 1]
    across, down, level = across[line], down[line], level[line]
    at_start = start[:, 0][at] * across + start[:, 1][at] * down - level
    at_stop = stop[:, 0][at] * across + stop[:, 1][at] * down - level
    begins_out, ends_out = at_start < 0, at_stop < 0
    with np.errstate(divide="ignore", invalid="ignore"):  # parallel edges do not use the crossing
        crossing = at_start / (at_start - at_stop)
    entering = np.where(begins_out, crossing, 0.0)
    entering[begins_out & ends_out] = 2.0
    begins = np.cumsum(lines) - lines
    entry = np.maximum.reduceat(entering, begins)
    leave = np.minimum.reduceat(np.where(ends_out, crossing, 1.0), begins)
    through = entry < leave
    return edge[through], polygon[through], entry[through], leave[through]


def _ranges(first: Ints, counts: Ints) -> Ints:
    """Return the concatenated ranges first .. first + counts - 1."""
    ends = np.cumsum(counts)
    return np.arange(counts.sum()) + np.repeat(first - ends + counts, counts)
