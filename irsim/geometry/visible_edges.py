"""Convex polygons that hide each other: the edges that can be seen, and what changes across them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from irsim.geometry.polygon import pieces
from irsim.types import Floats

_INSET_PX = 1e-9
"""The edges of each layer lie this much further in than those of the one in front. Edges of two layers
that would coincide, where rounding would say at random which is inside which, are told apart by it. Of a picture that
is smaller than a pixel by as much less: corners that it moves by leave gaps, whose light reaches across cells."""

Ints = npt.NDArray[np.int64]


def visible_edges(
    start: Floats, stop: Floats, layer: Ints, glow: Floats, layers: tuple[int, ...] = ()
) -> tuple[Floats, Floats, Floats, Ints]:
    """(start, stop, weights, layer): the visible pieces of edges, what (opacity, glow) gains across each, and whose.

    start, stop  (n, 2) px: the edges, clockwise as seen with y down, one convex polygon a layer
    layer        (n,) the polygon of each edge, rising; layer 0 is the nearest
    glow         (layers,) what each polygon shines with
    layers       how many of the layers, in order, belong to each of several pictures; those of one hide
                 nothing in another. One picture where empty

    Between two pieces the field is flat: an edge of polygon k counts where no nearer polygon covers
    it, and parts k from the nearest of the farther polygons that cover it.
    """
    layers = layers or (len(glow),)
    firsts = np.cumsum(layers) - layers
    depth = layer - np.repeat(firsts, layers)[layer]
    edges = np.searchsorted(layer, firsts)
    side = (np.maximum.reduceat(start, edges) - np.minimum.reduceat(start, edges)).max(axis=1)
    inset = np.repeat(_INSET_PX * np.minimum(side, 1.0), layers)[layer]
    delta = stop - start
    across, down = -delta[:, 1], delta[:, 0]
    length = np.maximum(np.sqrt(across * across + down * down), 1e-300)
    start = start + np.column_stack([across, down]) * (inset * depth / length)[:, None]
    stop = start + delta

    edge, polygon, entry, leave = _covered(start, stop, layer, len(glow), layers)
    count, nothing = len(start), len(glow)
    cut, begin, end = pieces(count, np.concatenate([edge, edge]), np.concatenate([entry, leave]))
    # Of each piece, all polygons that cover a part of its edge.
    counts = np.bincount(edge, minlength=count)
    first, each = (np.cumsum(counts) - counts)[cut], counts[cut]
    which, middle = _runs(first, each), np.repeat((begin + end) / 2, each)
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
    # Pieces that follow each other with the same gains are one.
    joined = (cut[1:] == cut[:-1]) & (begin[1:] == end[:-1]) & (bare[1:] == bare[:-1]) & (gain[1:] == gain[:-1])
    begins, ends = np.ones(len(cut), np.bool_), np.ones(len(cut), np.bool_)
    begins[1:], ends[:-1] = ~joined, ~joined
    heads, tails = np.flatnonzero(begins), np.flatnonzero(ends)
    cut = cut[heads]
    origin, along = start.take(cut, axis=0), delta.take(cut, axis=0)
    weights = np.stack([bare[heads], gain[heads]], axis=1)
    return origin + along * begin[heads, None], origin + along * end[tails, None], weights, layer[cut]


def _covered(
    start: Floats, stop: Floats, layer: Ints, count: int, layers: tuple[int, ...]
) -> tuple[Ints, Ints, Floats, Floats]:
    """(edge, polygon, entry, leave) of the edges that run through other polygons of their picture, by edge and
    polygon: from which place to which along the edge, 0..1. Only where their boxes meet is it looked for."""
    sides = np.bincount(layer, minlength=count)
    first = np.cumsum(sides) - sides
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    lows, highs = np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)
    picture = np.repeat(np.arange(len(layers)), layers)
    meet = (lows[:, None, 0] <= highs[:, 0]) & (lows[:, None, 1] <= highs[:, 1])
    meet &= meet.T & (picture[:, None] == picture)
    np.fill_diagonal(meet, False)
    mine, polygon = np.nonzero(meet)
    edge, polygon = _runs(first[mine], sides[mine]), np.repeat(polygon, sides[mine])
    near = np.ones(len(edge), dtype=bool)
    for axis in (0, 1):
        near &= low[:, axis][edge] <= highs[:, axis][polygon]
        near &= high[:, axis][edge] >= lows[:, axis][polygon]
    edge, polygon = edge[near], polygon[near]
    order = np.argsort(edge, kind="stable")
    edge, polygon = edge[order], polygon[order]
    if not len(edge):
        return edge, polygon, np.zeros(0), np.zeros(0)

    # How far an edge's ends are inside each line of the polygon.
    lines = sides[polygon]
    line, at = _runs(first[polygon], lines), np.repeat(edge, lines)
    delta = stop - start
    across, down = -delta[:, 1], delta[:, 0]
    level = across * start[:, 0] + down * start[:, 1]
    across, down, level = across[line], down[line], level[line]
    at_start = start[:, 0][at] * across + start[:, 1][at] * down - level
    at_stop = stop[:, 0][at] * across + stop[:, 1][at] * down - level
    begins_out, ends_out = at_start < 0, at_stop < 0
    with np.errstate(divide="ignore", invalid="ignore"):  # parallel edges cross nowhere and use no crossing
        crossing = at_start / (at_start - at_stop)
    entering = np.where(begins_out, crossing, 0.0)
    entering[begins_out & ends_out] = 2.0
    begins = np.cumsum(lines) - lines
    entry = np.maximum.reduceat(entering, begins)
    leave = np.minimum.reduceat(np.where(ends_out, crossing, 1.0), begins)
    through = entry < leave
    return edge[through], polygon[through], entry[through], leave[through]


def _runs(first: Ints, counts: Ints) -> Ints:
    """Runs first .. first + counts - 1, one after the other."""
    ends = np.cumsum(counts)
    return np.arange(counts.sum()) + np.repeat(first - ends + counts, counts)
