"""The convex hull of few points: its faces and edges."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
import numpy.typing as npt

from irsim.targets.solids import Point3
from irsim.types import Floats

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Hull:
    """vertices (V, 3); a face's plane is normal . v = offset: normals (F, 3), outward unit vectors, offsets (F,), and
    corner (F,), a vertex of each; edges (E, 4): each runs from vertex tail to head with its face left counter-clockwise
    as seen from outside, its face right on the other side.
    """

    vertices: Floats
    normals: Floats
    offsets: Floats
    corner: Ints
    edges: Ints


@lru_cache(maxsize=4096)  # a body's parts are cut from each other, then put together in each of its lengths
def hull(points: tuple[Point3, ...]) -> Hull:
    """That of at most some 50 points. Raises ValueError where they have no volume."""
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
    """Outward unit normals (F, 3) of the faces, and their corners counter-clockwise from outside.

    Every plane through three points that has all others behind it: n^4 work.
    """
    a, b, c = _threes(len(points))
    first, second = points[b] - points[a], points[c] - points[a]
    normals = np.cross(first, second)
    lengths = np.linalg.norm(normals, axis=1)
    size = np.ptp(points, axis=0).max()
    thick = lengths > 1e-9 * size**2
    normals, a = normals[thick] / lengths[thick, None], a[thick]
    heights = _along(normals, points) - np.sum(normals * points[a], axis=1)[:, None]
    tolerance = 1e-7 * size
    outward = np.concatenate(
        [normals[(heights <= tolerance).all(axis=1)], -normals[(heights >= -tolerance).all(axis=1)]]
    )
    heights = _along(outward, points)
    on = heights > heights.max(axis=1, keepdims=True) - tolerance
    faces = {corners.tobytes(): which for which, corners in enumerate(on)}  # of many corners: found from each three
    which = list(faces.values())
    return outward[which], [_ring(points, outward[face], np.flatnonzero(on[face])) for face in which]


@lru_cache(maxsize=64)
def _threes(count: int) -> Ints:
    """(3, ways) all ways to take three of so many."""
    return np.array(list(combinations(range(count), 3))).T


def _along(normals: Floats, points: Floats) -> Floats:
    """(normals, points) how far each point lies along each normal: without the threads of a matrix product, which go on
    spinning for longer than all of this takes."""
    return np.asarray(np.einsum("ni,pi->np", normals, points))


def _ring(points: Floats, normal: Floats, corners: Ints) -> list[int]:
    """A face's corners in order, counter-clockwise about its normal."""
    across = points[corners] - points[corners].mean(axis=0)
    x, y, z = normal.tolist()
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # its product with a vector is normal x that
    angles = np.arctan2(across @ (turn @ across[0]), across @ across[0])
    ring: list[int] = corners[np.argsort(angles)].tolist()
    return ring
