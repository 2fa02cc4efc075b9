"""Parts of a body: convex solids, primitives to build them from, their hulls, and transforms of moving parts.

Body axes: x forward, y right, z down. Lengths are relative to the body's length. A solid is the convex hull of its
points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.types import Floats

Ints = npt.NDArray[np.int64]

Point3 = tuple[float, float, float]

JointAngle = Annotated[float, Field(ge=-360, le=360)]
"""Angle of a moving part in frame 0, degrees."""

_SIDES = 8
"""Corners of a round cross-section."""


@dataclass(frozen=True)
class Solid:
    """Convex hull of points.

    points    at least four that do not lie in a plane
    material  temperature key of the body, such as `engine_k`
    joint     joint of the body that moves it; empty for a fixed part
    """

    points: tuple[Point3, ...]
    material: str = "temperature_k"
    joint: str = ""


def tube(*stations: tuple[float, float, float, float], material: str = "temperature_k") -> Solid:
    """Return a round solid along x with elliptic cross-sections (x, z of the centre, half width, half height)."""
    angles = 2 * np.pi * (np.arange(_SIDES) + 0.5) / _SIDES
    rings = [
        (x, float(wide * np.sin(angle)), float(z + high * np.cos(angle)))
        for x, z, wide, high in stations
        for angle in angles
    ]
    return Solid(tuple(rings), material)


def plate(outline: tuple[tuple[float, float], ...], low: float, high: float, material: str = "temperature_k") -> Solid:
    """Return a flat solid: an outline (x, y), seen from above, from z = low to z = high."""
    return Solid(tuple((x, y, z) for x, y in outline for z in (low, high)), material)


def profile(
    outline: tuple[tuple[float, float], ...], left: float, right: float, material: str = "temperature_k"
) -> Solid:
    """Return a flat solid: an outline (x, z), seen from the side, from y = left to y = right."""
    return Solid(tuple((x, y, z) for x, z in outline for y in (left, right)), material)


def block(low: Point3, high: Point3, material: str = "temperature_k") -> Solid:
    """Return a box between two opposite corners."""
    return plate(
        ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])), low[2], high[2], material
    )


def ball(middle: Point3, halves: Point3, material: str = "temperature_k") -> Solid:
    """Return an ellipsoid with semi-axes along x, y and z, as three rings and two poles."""
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    equator = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    rings = [np.cos(rise) * equator + [0.0, 0.0, np.sin(rise)] for rise in np.radians([-45.0, 0.0, 45.0])]
    points = np.concatenate([*rings, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    return Solid(tuple(_point(np.asarray(middle) + np.asarray(halves) * each) for each in points), material)


def limb(
    start: Point3, stop: Point3, first: float, last: float, material: str = "temperature_k", sides: int = 6
) -> Solid:
    """Return a truncated cone between two points, with radii `first` and `last` at its ends."""
    along = np.subtract(stop, start)
    along = along / np.linalg.norm(along)
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across /= np.linalg.norm(across)
    other = np.cross(along, across)
    angles = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    rim = np.outer(np.cos(angles), across) + np.outer(np.sin(angles), other)
    rings = [np.asarray(start) + first * rim, np.asarray(stop) + last * rim]
    return Solid(tuple(_point(each) for each in np.concatenate(rings)), material)


def wheel(middle: Point3, radius: float, wide: float, material: str = "temperature_k") -> Solid:
    """Return a disc of width `wide` about an axis along y through `middle`."""
    return limb(
        (middle[0], middle[1] - wide / 2, middle[2]),
        (middle[0], middle[1] + wide / 2, middle[2]),
        radius,
        radius,
        material,
        sides=10,
    )


def mirrored(solid: Solid) -> Solid:
    """Return the solid mirrored left to right; a joint 'left…' becomes 'right…'."""
    joint = "right" + solid.joint[4:] if solid.joint.startswith("left") else solid.joint
    return Solid(tuple((x, -y, z) for x, y, z in solid.points), solid.material, joint)


def shifted(solid: Solid, by: Point3) -> Solid:
    """Return the solid translated."""
    return replace(solid, points=tuple((x + by[0], y + by[1], z + by[2]) for x, y, z in solid.points))


def tilted(solid: Solid, rise: float) -> Solid:
    """Return the solid sheared upwards by `rise` per unit to the right: the dihedral of a right wing."""
    return replace(solid, points=tuple((x, y, z - rise * y) for x, y, z in solid.points))


def attached(joint: str, *solids: Solid) -> tuple[Solid, ...]:
    """Return the solids attached to a joint."""
    return tuple(replace(solid, joint=joint) for solid in solids)


def _point(values: Floats) -> Point3:
    x, y, z = values.tolist()
    return x, y, z


@dataclass(frozen=True, eq=False)
class Hull:
    """Convex polyhedron.

    vertices  (V, 3)
    normals   (F, 3) outward unit normals of the faces; a face's plane is normal . v = offset
    offsets   (F,)
    corner    (F,) one vertex of each face
    edges     (E, 4) tail vertex, head vertex, left face, right face; the left face is counter-clockwise along the edge
              as seen from outside
    """

    vertices: Floats
    normals: Floats
    offsets: Floats
    corner: Ints
    edges: Ints


@lru_cache(maxsize=4096)  # needed when parts are split, and again for each length of a body
def convex_hull(points: tuple[Point3, ...]) -> Hull:
    """Return the convex hull of up to about 50 points. Raises ValueError if they enclose no volume."""
    vertices = np.unique(np.round(np.array(points), 12), axis=0)
    normals, rings = _faces(vertices)
    if len(rings) < 4:
        raise ValueError("no volume")
    sides = {side: face for face, ring in enumerate(rings) for side in zip(ring, ring[1:] + ring[:1], strict=True)}
    edges = np.array([(tail, head, left, sides[head, tail]) for (tail, head), left in sides.items() if tail < head])
    corner = np.empty(len(rings), dtype=np.int64)
    corner[edges[:, 2]] = corner[edges[:, 3]] = edges[:, 0]
    return Hull(vertices, normals, np.sum(normals * vertices[corner], axis=1), corner, edges)


def _faces(points: Floats) -> tuple[Floats, list[list[int]]]:
    """Return outward unit normals (F, 3) of the faces, and their corners counter-clockwise from outside.

    A face is any plane through three points with all others behind it: O(n^4).
    """
    a, b, c = _triples(len(points))
    first, second = points[b] - points[a], points[c] - points[a]
    normals = np.cross(first, second)
    lengths = np.linalg.norm(normals, axis=1)
    size = np.ptp(points, axis=0).max()
    thick = lengths > 1e-9 * size**2
    normals, a = normals[thick] / lengths[thick, None], a[thick]
    heights = _dot(normals, points) - np.sum(normals * points[a], axis=1)[:, None]
    tolerance = 1e-7 * size
    outward = np.concatenate(
        [normals[(heights <= tolerance).all(axis=1)], -normals[(heights >= -tolerance).all(axis=1)]]
    )
    heights = _dot(outward, points)
    on = heights > heights.max(axis=1, keepdims=True) - tolerance
    faces = {corners.tobytes(): which for which, corners in enumerate(on)}  # a plane found several times counts once
    which = list(faces.values())
    return outward[which], [_ring(points, outward[face], np.flatnonzero(on[face])) for face in which]


@lru_cache(maxsize=64)
def _triples(count: int) -> Ints:
    """Return all triples (3, n) of `count` indices."""
    return np.array(list(combinations(range(count), 3))).T


def _dot(normals: Floats, points: Floats) -> Floats:
    """Return the dot products (normals, points); einsum avoids the start of BLAS threads."""
    return np.asarray(np.einsum("ni,pi->np", normals, points))


def _ring(points: Floats, normal: Floats, corners: Ints) -> list[int]:
    """Return a face's corners counter-clockwise about its normal."""
    across = points[corners] - points[corners].mean(axis=0)
    x, y, z = normal.tolist()
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # cross product with the normal
    angles = np.arctan2(across @ (turn @ across[0]), across @ across[0])
    ring: list[int] = corners[np.argsort(angles)].tolist()
    return ring


class RigidTransform(NamedTuple):
    """Rigid transform in body axes: v -> rotation v + translation, the translation in body lengths.

    numbers  the rotation's (3, 3) row by row, then the translation's 3; plain numbers take half the time of arrays
    """

    numbers: tuple[float, ...]

    @property
    def rotation(self) -> Floats:
        """Rotation matrix (3, 3)."""
        return np.array(self.numbers[:9]).reshape(3, 3)

    @property
    def translation(self) -> Floats:
        """Translation (3,), body lengths."""
        return np.array(self.numbers[9:])

    def __matmul__(self, other: RigidTransform) -> RigidTransform:
        """Return the composition that applies `other` first: `thigh @ knee` moves a shin with its thigh."""
        a, b, c, d, e, f, g, h, i, x, y, z = self.numbers
        j, k, l, m, n, o, p, q, r, u, v, w = other.numbers  # noqa: E741 - a row of letters
        return RigidTransform(
            (
                *(a * j + b * m + c * p, a * k + b * n + c * q, a * l + b * o + c * r),
                *(d * j + e * m + f * p, d * k + e * n + f * q, d * l + e * o + f * r),
                *(g * j + h * m + i * p, g * k + h * n + i * q, g * l + h * o + i * r),
                *(a * u + b * v + c * w + x, d * u + e * v + f * w + y, g * u + h * v + i * w + z),
            )
        )


def joint_angle(start_deg: float, hz: float, time: float) -> float:
    """Return the angle, radians, at a time, s, of a joint rotating at `hz` from `start_deg`."""
    return math.radians(start_deg) + 2 * math.pi * hz * time


def hinge(pivot: Point3, axis: Point3, angle: float) -> RigidTransform:
    """Return the rotation by `angle` radians about an axis (unit vector) through a point, by Rodrigues' formula.

    Right-handed: a positive angle about y (right) raises points ahead of the pivot, about z (down) it moves them to the
    right.
    """
    (x, y, z), (px, py, pz), sine, cosine = axis, pivot, math.sin(angle), math.cos(angle)
    rest = 1 - cosine
    along_x, along_y = rest * x, rest * y
    xy, xz, yz = along_x * y, along_x * z, along_y * z
    about_x, about_y, about_z = sine * x, sine * y, sine * z
    a, b, c = cosine + along_x * x, xy - about_z, xz + about_y
    d, e, f = xy + about_z, cosine + along_y * y, yz - about_x
    g, h, i = xz - about_y, yz + about_x, cosine + rest * z * z
    u, v, w = px - (a * px + b * py + c * pz), py - (d * px + e * py + f * pz), pz - (g * px + h * py + i * pz)
    return RigidTransform((a, b, c, d, e, f, g, h, i, u, v, w))
