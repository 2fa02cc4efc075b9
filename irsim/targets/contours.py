"""The exact outline of a triangle mesh: edges of what its front faces cover together.

Edges between two front faces cancel; what is left bounds the field m, how many front faces lie behind
each point. The outline is where m goes from 0 to more. So contour edges are cut where they cross each
other, and of the pieces those stay that have m = 0 on one side. No sampling: the result moves with the
vertices, and its cost goes with the contour, not with the faces.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from irsim.geometry.polygon import cut_edges
from irsim.types import Floats

_TILT = 0.3719
"""Radians: rays to count m along are turned by this, so that edges of upright bodies do not lie along them."""
_NUDGE_PX = 1e-7
"""Vertices are moved at random by this: no two edges coincide, and all else follows."""

Ints = npt.NDArray[np.int64]


def contour(pixels: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """(start, stop) (n, 2) px of the outline of front faces (F, 3) of vertices at pixels (V, 2).

    Outlines run clockwise as seen with y down, like the front faces themselves.
    """
    nudge = np.random.Generator(np.random.SFC64(0)).uniform(-_NUDGE_PX, _NUDGE_PX, pixels.shape)
    places = pixels + nudge
    tail, head, count = _bounding(faces, len(pixels))
    turn = np.array([[np.cos(_TILT), -np.sin(_TILT)], [np.sin(_TILT), np.cos(_TILT)]])
    turned = places @ turn.T
    one, other = _pairs(turned[tail, 1], turned[head, 1])
    apart = (tail[one] != tail[other]) & (tail[one] != head[other])
    apart &= (head[one] != tail[other]) & (head[one] != head[other])
    edge, begin, end = _cut(turned[tail], turned[head], one[apart], other[apart])
    outer = _covers(turned[tail], turned[head], count, one, other, edge, (begin + end) / 2)
    # m on the two sides of a piece differs by its count; the lesser side is the outer one.
    kept = outer == 0
    edge, begin, end = edge[kept], begin[kept, None], end[kept, None]
    origin, along = places[tail[edge]], places[head[edge]] - places[tail[edge]]
    return origin + along * begin, origin + along * end


def _bounding(faces: Ints, vertices: int) -> tuple[Ints, Ints, Ints]:
    """Edges that do not cancel between faces, in the direction of their face: tails, heads, counts above 0."""
    tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    keys, inverse = np.unique(low * vertices + high, return_inverse=True)
    net = np.bincount(inverse, np.where(tail < head, 1, -1), minlength=len(keys)).astype(np.int64)
    keys, net = keys[net != 0], net[net != 0]
    low, high = keys // vertices, keys % vertices
    forward = net > 0
    return np.where(forward, low, high), np.where(forward, high, low), np.abs(net)


def _pairs(tail_y: Floats, head_y: Floats) -> tuple[Ints, Ints]:
    """All (one, other) of different edges whose spans of y overlap, each pair both ways."""
    low, high = np.minimum(tail_y, head_y), np.maximum(tail_y, head_y)
    order = np.argsort(low, kind="stable")
    last = np.searchsorted(low[order], high[order], side="right")
    counts = np.maximum(last - np.arange(len(order)) - 1, 0)
    one = np.repeat(np.arange(len(order)), counts)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
    one, other = order[one], order[other]
    return np.concatenate([one, other]), np.concatenate([other, one])


def _cut(start: Floats, stop: Floats, one: Ints, other: Ints) -> tuple[Ints, Floats, Floats]:
    """Edges cut where `one` crosses `other`: (edge, begin, end) of each piece."""
    delta = stop - start

    def side(points: Floats, edges: Ints) -> Floats:
        away = points - start[edges]
        return np.asarray(delta[edges, 0] * away[:, 1] - delta[edges, 1] * away[:, 0])

    before, after = side(start[one], other), side(stop[one], other)
    crossed = (before < 0) != (after < 0)
    one, other, before, after = one[crossed], other[crossed], before[crossed], after[crossed]
    within = (side(start[other], one) < 0) != (side(stop[other], one) < 0)
    place = (before / (before - after))[within]
    return cut_edges(len(start), one[within], place)


def _covers(start: Floats, stop: Floats, count: Ints, one: Ints, other: Ints, edge: Ints, place: Floats) -> Ints:
    """(pieces,) m on the outer side of each piece: edges that a ray to the right from its middle crosses.

    one, other  pairs of edges whose spans of y overlap: only these can be crossed.
    """
    order = np.argsort(one, kind="stable")
    one, other = one[order], other[order]
    first = np.searchsorted(one, edge)
    counts = np.searchsorted(one, edge, side="right") - first
    piece = np.repeat(np.arange(len(edge)), counts)
    against = other[np.repeat(first, counts) + np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)]
    middle = start[edge] + (stop - start)[edge] * place[:, None]
    x, y = middle[piece].T
    (x0, y0), (x1, y1) = start[against].T, stop[against].T
    spans = (np.minimum(y0, y1) <= y) & (y < np.maximum(y0, y1))
    with np.errstate(divide="ignore", invalid="ignore"):
        right = spans & (x0 + (x1 - x0) * (y - y0) / (y1 - y0) > x)
    # Clockwise as seen with y down: an edge that runs down has the inside on its left.
    sign = np.where(y1 > y0, 1, -1) * count[against]
    seen = np.bincount(piece[right], sign[right], minlength=len(edge)).astype(np.int64)
    # To the right of the piece itself; on its left there is its own count more, or less.
    own = np.where(stop[edge, 1] > start[edge, 1], 1, -1) * count[edge]
    return np.asarray(np.minimum(seen, seen + own))
