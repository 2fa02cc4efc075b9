"""Visibility of a body's parts: splitting of intersecting parts, and part outlines in depth order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from irsim.geometry.silhouette import LayeredPolygons, clip_or_corner
from irsim.targets.base import View
from irsim.targets.parts import Hull, Ints, Point3, RigidTransform, Solid, convex_hull
from irsim.targets.polyhedra import Polyhedra
from irsim.types import Box, Floats

_THIN = 1e-5
"""Thickness, relative to the body's length, below which nothing is cut off."""
_MOST_PIECES = 2
"""Largest number of pieces of a split part. Other parts stay whole, to bound the drawing time of the body."""


@dataclass(frozen=True, eq=False)
class Joints:
    """Joints of a body.

    names    of the joints
    of_part  index of each part's joint, -1 for fixed parts
    """

    names: tuple[str, ...]
    of_part: Ints


def part_outlines(
    body: Polyhedra,
    joints: Joints,
    transforms: Mapping[str, RigidTransform],
    scale: float,
    view: View,
    radiance: Floats,
) -> LayeredPolygons | None:
    """Return the outlines of a body's parts in a view, one layer for each; None if any part lies behind the camera.

    body        in its rest pose
    transforms  of the joints, translations in units of `scale`
    radiance    (parts,) W/m2/sr

    Coordinates are relative to the body's middle, which keeps the digits of a small body.
    """
    right, down, ahead = view.position.tolist()
    if ahead <= 0:
        return None
    geometry = view.context.geometry
    (x, y), scale_px = geometry.axis_px, 1 / (ahead * geometry.ifov_rad)
    x, y = x + right * scale_px, y + down * scale_px
    moved = {part: transforms[joints.names[joint]] for part, joint in enumerate(joints.of_part.tolist()) if joint >= 0}
    body = body.posed(moved, scale)
    tail, head, left_face, right_face, part = body.topology.edges.T
    offsets, position = body.vertices @ view.attitude.T, view.position
    depth = offsets[:, 2] + position[2]
    if depth.min() <= 0:
        return None
    pixels = (offsets[:, :2] - position[:2] / position[2] * offsets[:, 2:]) / (depth * geometry.ifov_rad)[:, None]
    (west, north), (east, south) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
    eye = -position @ view.attitude
    faces_eye = body.normals @ eye > body.offsets
    left = faces_eye[left_face]
    on_outline = left != faces_eye[right_face]
    # Sorted by layer, the nearest first: the edges of a layer must be contiguous.
    rank = body.depth_order(eye, pixels)
    edge = np.flatnonzero(on_outline)
    layer = rank[part[edge]]
    by_layer = np.argsort(layer, kind="stable")
    order, layer = edge[by_layer], layer[by_layer]
    # A front face is clockwise with x right, y down if its edges are read backwards.
    start = pixels[np.where(left, head, tail)[order]]
    stop = pixels[np.where(left, tail, head)[order]]
    glow = np.empty(len(rank))
    glow[rank] = radiance
    box, range_m = Box.from_edges(x + west, y + north, x + east, y + south), math.hypot(*view.position.tolist())
    window = clip_or_corner(box, view.context)
    return LayeredPolygons((start, stop, layer), glow, box, window, view.context.psf, range_m, (x, y))


@dataclass(frozen=True, eq=False)
class _Piece:
    """A solid and its convex hull."""

    solid: Solid
    hull: Hull


def split_intersections(solids: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """Return solids with the same visible surface, intersecting ones split where possible.

    No depth order is right for two intersecting parts: the light jumps where their order changes. Therefore, of two
    intersecting parts of different material on one joint, one is replaced by its pieces outside the other, cut along
    the planes of the other's faces, if there are at most two pieces.
    """
    done: list[_Piece] = []
    waiting = [_piece(solid, np.array(solid.points)) for solid in reversed(solids)]
    while waiting:
        one = waiting.pop()
        for other in done:
            if not _intersect(one, other):
                continue
            rest = [each for each in (*done, *waiting) if each is not other]
            choices = [(_outside(one, other, rest), other), (_outside(other, one, rest), one)]
            pieces, whole = min(choices, key=lambda choice: _cost(choice[0]))
            if len(pieces) <= _MOST_PIECES:
                done.remove(other)
                waiting += [whole, *pieces]  # tested again: a cut may remove the face that separated two parts
                break
        else:
            done.append(one)
    return tuple(piece.solid for piece in done)


def _piece(of: Solid, points: Floats) -> _Piece:
    """Return the convex hull of points, with nearly coincident points merged."""
    places: list[Point3] = []
    for x, y, z in points.tolist():
        if all(max(abs(x - u), abs(y - v), abs(z - w)) > _THIN for u, v, w in places):
            places.append((x, y, z))
    return _Piece(replace(of, points=tuple(places)), convex_hull(tuple(places)))


def _intersect(one: _Piece, other: _Piece) -> bool:
    """Return True if two pieces of different material on the same joint each reach behind all faces of the other."""
    if one.solid.material == other.solid.material or one.solid.joint != other.solid.joint:
        return False
    return all(_heights(a, b).min(axis=0).max() < -_THIN for a, b in ((one, other), (other, one)))


def _heights(one: _Piece, other: _Piece) -> Floats:
    """Return the signed distances (vertices, faces) of the vertices of `one` from the faces of `other`."""
    return np.asarray(one.hull.vertices @ other.hull.normals.T - other.hull.offsets)


def _outside(one: _Piece, other: _Piece, rest: Iterable[_Piece]) -> list[_Piece]:
    """Return the pieces of `one` outside `other`, except those hidden inside a piece of `rest`.

    The search stops after `_MOST_PIECES` + 1 pieces.
    """
    found: list[_Piece] = []
    hiding = [each for each in rest if each.solid.joint == one.solid.joint]
    while (before := _heights(one, other).max(axis=0)).max() > _THIN and len(found) <= _MOST_PIECES:
        face = int(before.argmax())
        normal, offset = other.hull.normals[face], float(other.hull.offsets[face])
        piece = _cut(one, normal, offset)
        if all(_heights(piece, each).max() > _THIN for each in hiding):
            found.append(piece)
        one = _cut(one, -normal, -offset)
    return found


def _cut(piece: _Piece, normal: Floats, offset: float) -> _Piece:
    """Return the part of a piece in front of a plane."""
    vertices, (tail, head, _, _) = piece.hull.vertices, piece.hull.edges.T
    heights = vertices @ normal - offset
    heights[np.abs(heights) <= _THIN] = 0.0
    crosses = heights[tail] * heights[head] < 0
    tail, head = tail[crosses], head[crosses]
    share = heights[tail] / (heights[tail] - heights[head])
    met = vertices[tail] + share[:, None] * (vertices[head] - vertices[tail])
    return _piece(piece.solid, np.concatenate([vertices[heights >= 0], met]))


def _cost(pieces: list[_Piece]) -> tuple[int, int]:
    """Return the number of pieces and of their vertices, by which the cheaper of two splits is chosen."""
    return len(pieces), sum(len(piece.hull.vertices) for piece in pieces)
