"""Convex polygons that hide each other: the edges that can be seen, and what changes across them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from irsim.shapes.polygon import pieces
from irsim.types import Floats

_INSET_PX = 1e-9
"""The edges of each layer lie this much further in than those of the one in front. Edges of two layers
that would coincide, where rounding would say at random which is inside which, are told apart by it."""


def visible_edges(
    start: Floats, stop: Floats, layer: npt.NDArray[np.int64], glow: Floats
) -> tuple[Floats, Floats, Floats]:
    """(start, stop, weights): the visible pieces of edges, and what (opacity, glow) gains across each.

    start, stop  (n, 2) px: the edges, clockwise as seen with y down, one convex polygon a layer
    layer        (n,) the polygon of each edge, rising; layer 0 is the nearest
    glow         (layers,) what each polygon shines with

    Between two pieces the field is flat: an edge of polygon k counts where no nearer polygon covers
    it, and parts k from the nearest of the farther polygons that cover it.
    """
    first = np.searchsorted(layer, np.arange(len(glow)))
    delta = stop - start
    across, down = -delta[:, 1], delta[:, 0]
    length = np.maximum(np.hypot(across, down), 1e-300)
    start = start + np.stack([across, down], axis=1) * (_INSET_PX * layer / length)[:, None]
    stop = start + delta

    # (lines, edges): how far each edge's ends are inside each edge's line; a convex polygon is inside all of its own.
    level = (across * start[:, 0] + down * start[:, 1])[:, None]
    across, down = across[:, None], down[:, None]
    at_start = start[:, 0] * across + start[:, 1] * down - level
    at_stop = stop[:, 0] * across + stop[:, 1] * down - level
    begins_out, ends_out = at_start < 0, at_stop < 0
    with np.errstate(divide="ignore", invalid="ignore"):  # parallel edges cross nowhere and use no crossing
        crossing = at_start / (at_start - at_stop)
    entering = np.where(begins_out, crossing, 0.0)
    entering[begins_out & ends_out] = 2.0
    entry = np.maximum.reduceat(entering, first, axis=0)
    leave = np.minimum.reduceat(np.where(ends_out, crossing, 1.0), first, axis=0)
    entry[layer, np.arange(len(start))] = 2.0  # nothing is inside itself

    polygons, edges = np.nonzero(entry < leave)
    cuts = np.concatenate([entry[polygons, edges], leave[polygons, edges]])
    edge, begin, end = pieces(len(start), np.concatenate([edges, edges]), cuts)
    middle = (begin + end) / 2
    within = np.ones((len(glow) + 1, len(edge)), dtype=bool)  # the last stands for nothing at all
    within[:-1] = (entry[:, edge] < middle) & (middle < leave[:, edge])
    nearest = within.argmax(axis=0)
    own = layer[edge]
    bare = nearest == len(glow)
    gain = glow[own] - np.append(glow, 0.0)[nearest]
    seen = np.flatnonzero((nearest > own) & (bare | (gain != 0)))
    edge, begin, end, bare, gain = edge[seen], begin[seen], end[seen], bare[seen], gain[seen]
    # Pieces that follow each other with the same gains are one.
    joined = (edge[1:] == edge[:-1]) & (begin[1:] == end[:-1]) & (bare[1:] == bare[:-1]) & (gain[1:] == gain[:-1])
    heads, tails = np.flatnonzero(np.append(True, ~joined)), np.flatnonzero(np.append(~joined, True))
    edge = edge[heads]
    origin, along = start[edge], delta[edge]
    weights = np.stack([bare[heads], gain[heads]], axis=1)
    return origin + along * begin[heads, None], origin + along * end[tails, None], weights
