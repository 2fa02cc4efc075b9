"""Rasterisation of triangle meshes: the exact outline of the front faces, and a z-buffer of the nearest faces.

Outline: edges shared by two front faces cancel. The remaining edges bound the field m, the number of front faces behind
each point, and the outline is where m rises from 0. Edges are therefore cut at their crossings, and the pieces with m =
0 on one side remain. Nothing is sampled: the result is continuous in the vertices, and its cost grows with the outline,
not with the number of faces.
"""

from __future__ import annotations

import numpy as np

from irsim.geometry.polygon import cut_edges
from irsim.targets.parts import Ints
from irsim.types import Floats

_TILT = 0.3719
"""Rotation, radians, of the rays along which m is counted, so that no edge of an upright body lies along them."""
_NUDGE_PX = 1e-7
"""Random displacement of vertices, so that no two edges coincide."""


def outline_edges(pixels: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """Return (start, stop) (n, 2) px of the outline of front faces (F, 3) with vertices at pixels (V, 2).

    Outlines run clockwise as seen with y down, as do the front faces.
    """
    nudge = np.random.Generator(np.random.SFC64(0)).uniform(-_NUDGE_PX, _NUDGE_PX, pixels.shape)
    places = pixels + nudge
    tail, head, count = _boundary_edges(faces, len(pixels))
    turn = np.array([[np.cos(_TILT), -np.sin(_TILT)], [np.sin(_TILT), np.cos(_TILT)]])
    turned = places @ turn.T
    one, other = _overlapping_pairs(turned[tail, 1], turned[head, 1])
    apart = (tail[one] != tail[other]) & (tail[one] != head[other])
    apart &= (head[one] != tail[other]) & (head[one] != head[other])
    edge, begin, end = _cut_at_crossings(turned[tail], turned[head], one[apart], other[apart])
    outer = _faces_outside(turned[tail], turned[head], count, one, other, edge, (begin + end) / 2)
    # m differs by the edge's count between the two sides of a piece; the side of lower m is the outer one.
    kept = outer == 0
    edge, begin, end = edge[kept], begin[kept, None], end[kept, None]
    origin, along = places[tail[edge]], places[head[edge]] - places[tail[edge]]
    return origin + along * begin, origin + along * end


def _boundary_edges(faces: Ints, vertices: int) -> tuple[Ints, Ints, Ints]:
    """Return (tail, head, count) of boundary edges: uses of an edge by faces in opposite directions cancel, `count`
    uses are left."""
    tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    keys, inverse = np.unique(low * vertices + high, return_inverse=True)
    net = np.bincount(inverse, np.where(tail < head, 1, -1), minlength=len(keys)).astype(np.int64)
    keys, net = keys[net != 0], net[net != 0]
    low, high = keys // vertices, keys % vertices
    forward = net > 0
    return np.where(forward, low, high), np.where(forward, high, low), np.abs(net)


def _overlapping_pairs(tail_y: Floats, head_y: Floats) -> tuple[Ints, Ints]:
    """Return all ordered pairs (one, other) of distinct edges whose intervals in y overlap."""
    low, high = np.minimum(tail_y, head_y), np.maximum(tail_y, head_y)
    order = np.argsort(low, kind="stable")
    last = np.searchsorted(low[order], high[order], side="right")
    counts = np.maximum(last - np.arange(len(order)) - 1, 0)
    one = np.repeat(np.arange(len(order)), counts)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
    one, other = order[one], order[other]
    return np.concatenate([one, other]), np.concatenate([other, one])


def _cut_at_crossings(start: Floats, stop: Floats, one: Ints, other: Ints) -> tuple[Ints, Floats, Floats]:
    """Return (edge, begin, end) of the pieces of edges cut where `one` crosses `other`."""
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


def _faces_outside(start: Floats, stop: Floats, count: Ints, one: Ints, other: Ints, edge: Ints, place: Floats) -> Ints:
    """Return m (pieces,) on the outer side of each piece, from the crossings of a ray to the right from its middle.

    one, other  pairs of edges whose intervals in y overlap; a ray crosses only such edges
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
    # Clockwise as seen with y down: a downward edge has the inside on its left.
    sign = np.where(y1 > y0, 1, -1) * count[against]
    seen = np.bincount(piece[right], sign[right], minlength=len(edge)).astype(np.int64)
    # `seen` is m on the right of the piece; on its left m differs by the piece's own count.
    own = np.where(stop[edge, 1] > start[edge, 1], 1, -1) * count[edge]
    return np.asarray(np.minimum(seen, seen + own))


def z_buffer(pixels: Floats, depth: Floats, faces: Ints, size: tuple[int, int]) -> Ints:
    """Return the number of the nearest triangle, (rows, columns), at each point (column, row) of a grid; -1 without
    one.

    pixels  (V, 2) in grid steps
    depth   (V,) m along the optical axis
    faces   (F, 3)
    """
    rows, columns = size
    corners = pixels[faces]
    low = np.maximum(np.ceil(corners.min(axis=1)), 0).astype(np.int64)
    high = np.minimum(np.floor(corners.max(axis=1)), [columns - 1, rows - 1]).astype(np.int64)
    wide, tall = np.maximum(high - low + 1, 0).T
    counts = wide * tall
    face = np.repeat(np.arange(len(faces)), counts)
    ordinal = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    x, y = low[face, 0] + ordinal % wide[face], low[face, 1] + ordinal // wide[face]
    (x0, y0), (x1, y1), (x2, y2) = (corners[face, corner].T for corner in range(3))
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    area = np.where(area == 0, np.inf, area)
    b = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
    c = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
    # 1/depth is linear in image coordinates.
    inverse = (1 / depth)[faces][face]
    near = inverse[:, 0] + b * (inverse[:, 1] - inverse[:, 0]) + c * (inverse[:, 2] - inverse[:, 0])
    inside = (b >= 0) & (c >= 0) & (b + c <= 1)
    cell, near, face = (y * columns + x)[inside], near[inside], face[inside]
    order = np.lexsort((near, cell))
    cell, face = cell[order], face[order]
    last = np.flatnonzero(np.append(cell[1:] != cell[:-1], True)) if len(cell) else np.zeros(0, dtype=np.int64)
    found = np.full(rows * columns, -1, dtype=np.int64)
    found[cell[last]] = face[last]
    return found.reshape(rows, columns)
