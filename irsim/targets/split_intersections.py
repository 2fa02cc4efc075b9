"""Parts of unlike heat that run into each other, cut so that the plane of a face parts them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from irsim.targets.hull import Hull, hull
from irsim.targets.solids import Point3, Solid
from irsim.types import Floats

_THIN = 1e-5
"""What is no thicker, a share of the body's length, is not cut off."""
_MOST = 2
"""A part that would become more pieces than these is left whole: the body's drawing would take longer."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """A solid and its convex hull."""

    solid: Solid
    hull: Hull


def parted(solids: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """Solids that fill the same space and show the same surface, most of which can be put in the order of their hiding.

    No order is right for two that run into each other: whichever it is, light jumps where it changes. So of two that
    are of unlike heat and move together, one becomes what of it lies outside the other, where that is no more than two
    pieces, cut off by planes of the other's faces.
    """
    done: list[_Piece] = []
    waiting = [_piece(solid, np.array(solid.points)) for solid in reversed(solids)]
    while waiting:
        one = waiting.pop()
        for other in done:
            if not _run_into_each_other(one, other):
                continue
            rest = [each for each in (*done, *waiting) if each is not other]
            ways = [(_outside(one, other, rest), other), (_outside(other, one, rest), one)]
            pieces, whole = min(ways, key=lambda way: _cost(way[0]))
            if len(pieces) <= _MOST:
                done.remove(other)
                waiting += [whole, *pieces]  # once more: a face that parted it from a third may be gone
                break
        else:
            done.append(one)
    return tuple(piece.solid for piece in done)


def _piece(of: Solid, points: Floats) -> _Piece:
    """The hull of points, those but once that are all but one."""
    places: list[Point3] = []
    for x, y, z in points.tolist():
        if all(max(abs(x - u), abs(y - v), abs(z - w)) > _THIN for u, v, w in places):
            places.append((x, y, z))
    return _Piece(replace(of, points=tuple(places)), hull(tuple(places)))


def _run_into_each_other(one: _Piece, other: _Piece) -> bool:
    """Does each of two, of unlike heat and on one joint, reach behind all faces of the other?"""
    if one.solid.heat == other.solid.heat or one.solid.joint != other.solid.joint:
        return False
    return all(_heights(a, b).min(axis=0).max() < -_THIN for a, b in ((one, other), (other, one)))


def _heights(one: _Piece, other: _Piece) -> Floats:
    """(vertices, faces) of the vertices of one over the faces of the other."""
    return np.asarray(one.hull.vertices @ other.hull.normals.T - other.hull.offsets)


def _outside(one: _Piece, other: _Piece, rest: Iterable[_Piece]) -> list[_Piece]:
    """What of one lies outside the other, as far as it can be seen: what lies within any of the rest cannot.

    One piece too many says that there are more.
    """
    found: list[_Piece] = []
    hiding = [each for each in rest if each.solid.joint == one.solid.joint]
    while (before := _heights(one, other).max(axis=0)).max() > _THIN and len(found) <= _MOST:
        face = int(before.argmax())
        normal, offset = other.hull.normals[face], float(other.hull.offsets[face])
        piece = _cut(one, normal, offset)
        if all(_heights(piece, each).max() > _THIN for each in hiding):
            found.append(piece)
        one = _cut(one, -normal, -offset)
    return found


def _cut(piece: _Piece, normal: Floats, offset: float) -> _Piece:
    """What of it lies before a plane."""
    vertices, (tail, head, _, _) = piece.hull.vertices, piece.hull.edges.T
    heights = vertices @ normal - offset
    heights[np.abs(heights) <= _THIN] = 0.0
    crosses = heights[tail] * heights[head] < 0
    tail, head = tail[crosses], head[crosses]
    share = heights[tail] / (heights[tail] - heights[head])
    met = vertices[tail] + share[:, None] * (vertices[head] - vertices[tail])
    return _piece(piece.solid, np.concatenate([vertices[heights >= 0], met]))


def _cost(pieces: list[_Piece]) -> tuple[int, int]:
    """How many there are, and how many corners they have."""
    return len(pieces), sum(len(piece.hull.vertices) for piece in pieces)
