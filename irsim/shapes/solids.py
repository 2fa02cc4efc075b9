"""Convex solids: the parts that bodies are made of.

Body axes: x forward, y right, z down. A solid is the convex hull of its points.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Point3 = tuple[float, float, float]

_SIDES = 8
"""Corners of a round section."""


@dataclass(frozen=True)
class Solid:
    """points: at least four that do not lie in a plane; heat: the body's key that holds its temperature."""

    points: tuple[Point3, ...]
    heat: str = "temperature_k"


def tube(*stations: tuple[float, float, float, float], heat: str = "temperature_k") -> Solid:
    """A round solid along x through stations (x, z, half width, half height)."""
    angles = 2 * np.pi * (np.arange(_SIDES) + 0.5) / _SIDES
    rings = [
        (x, float(wide * np.sin(angle)), float(z + high * np.cos(angle)))
        for x, z, wide, high in stations
        for angle in angles
    ]
    return Solid(tuple(rings), heat)


def plate(outline: tuple[tuple[float, float], ...], low: float, high: float, heat: str = "temperature_k") -> Solid:
    """A flat solid: an outline (x, y), seen from above, from z = low to z = high."""
    return Solid(tuple((x, y, z) for x, y in outline for z in (low, high)), heat)


def profile(outline: tuple[tuple[float, float], ...], left: float, right: float, heat: str = "temperature_k") -> Solid:
    """A flat solid: an outline (x, z), seen from the side, from y = left to y = right."""
    return Solid(tuple((x, y, z) for x, z in outline for y in (left, right)), heat)


def mirrored(solid: Solid) -> Solid:
    """The same on the other side."""
    return Solid(tuple((x, -y, z) for x, y, z in solid.points), solid.heat)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Several convex polyhedra.

    vertices (V, 3); normals (F, 3) outward and offsets (F,): a face's plane is normal . v = offset;
    Each edge runs from vertex `tail` to `head` with its face `left` counter-clockwise as seen from
    outside, `right` on its other side; `part` (E,) is the part it belongs to.
    For each pair of parts a plane parts them as well as any face of theirs can: `first` is on the
    side that `walls` (pairs, 3) point to from `reaches` (pairs,), `second` on the other.
    """

    vertices: Floats
    normals: Floats
    offsets: Floats
    tail: npt.NDArray[np.int64]
    head: npt.NDArray[np.int64]
    left: npt.NDArray[np.int64]
    right: npt.NDArray[np.int64]
    part: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    second: npt.NDArray[np.int64]
    walls: Floats
    reaches: Floats

    def hiding_order(self, eye: Floats) -> npt.NDArray[np.int64]:
        """(parts,) rank of each part as seen from `eye` (3,), the one that nothing hides first.

        Of two parts the one on the eye's side of their wall hides the other; for convex parts that
        do not meet this is exact, and where it changes neither hides the other.
        """
        nearer = self.walls @ eye > self.reaches
        hiders = np.bincount(np.where(nearer, self.second, self.first), minlength=int(self.part[-1]) + 1)
        rank = np.empty_like(hiders)
        rank[np.argsort(hiders, kind="stable")] = np.arange(len(hiders))
        return rank


def mesh(solids: tuple[Solid, ...], scale: float) -> Mesh:
    """The convex hulls of solids, their lengths times `scale`."""
    vertices: list[Floats] = []
    normals: list[Floats] = []
    edges: list[tuple[int, int, int, int, int]] = []
    owners: list[int] = []
    for part, solid in enumerate(solids):
        points = np.unique(np.round(np.array(solid.points), 9), axis=0)
        base, face = sum(map(len, vertices)), len(normals)
        sides = {}
        for normal, ring in _faces(points):
            for tail, head in zip(ring, ring[1:] + ring[:1], strict=True):
                sides[tail, head] = len(normals)
            normals.append(normal)
            owners.append(part)
        if len(normals) - face < 4:
            raise ValueError(f"solid {part} has no volume")
        edges += [
            (base + tail, base + head, left, sides[head, tail], part)
            for (tail, head), left in sides.items()
            if tail < head
        ]
        vertices.append(points)
    places = np.concatenate(vertices) * scale
    tail, head, left, right, owner = np.array(edges).T
    planes = np.array(normals)
    some_vertex = np.empty(len(planes), dtype=np.int64)
    some_vertex[left] = some_vertex[right] = tail
    offsets = np.sum(planes * places[some_vertex], axis=1)
    pairs = np.array(list(combinations(range(len(solids)), 2)), dtype=np.int64).reshape(-1, 2)
    walls = [_wall(pair, [points * scale for points in vertices], planes, offsets, np.array(owners)) for pair in pairs]
    return Mesh(
        vertices=places,
        normals=planes,
        offsets=offsets,
        tail=tail,
        head=head,
        left=left,
        right=right,
        part=owner,
        first=pairs[:, 0],
        second=pairs[:, 1],
        walls=np.array([wall for wall, _ in walls]).reshape(-1, 3),
        reaches=np.array([reach for _, reach in walls]),
    )


def _wall(
    pair: npt.NDArray[np.int64],
    vertices: list[Floats],
    normals: Floats,
    offsets: Floats,
    owners: npt.NDArray[np.int64],
) -> tuple[Floats, float]:
    """The face of either part that the other crosses least, as a plane that points to the first part."""
    best: tuple[float, Floats, float] | None = None
    for own, other, sign in ((1, 0, 1.0), (0, 1, -1.0)):
        faces = np.flatnonzero(owners == pair[own])
        crossing = offsets[faces] - (normals[faces] @ vertices[pair[other]].T).min(axis=1)
        least = faces[np.argmin(crossing)]
        if best is None or crossing.min() < best[0]:
            best = float(crossing.min()), sign * normals[least], sign * float(offsets[least])
    assert best is not None
    return best[1], best[2]


def _faces(points: Floats) -> list[tuple[Floats, list[int]]]:
    """Faces of the convex hull of (n, 3): outward unit normal, and corners counter-clockwise from outside.

    Every plane through three points that has all others behind it: n^4 work, at most some 50 points.
    """
    a, b, c = np.array(list(combinations(range(len(points)), 3))).T
    normals = np.cross(points[b] - points[a], points[c] - points[a])
    lengths = np.linalg.norm(normals, axis=1)
    size = np.ptp(points, axis=0).max()
    thick = lengths > 1e-9 * size**2
    normals, a = normals[thick] / lengths[thick, None], a[thick]
    heights = normals @ points.T - np.sum(normals * points[a], axis=1)[:, None]
    tolerance = 1e-7 * size
    outward = np.concatenate(
        [normals[(heights <= tolerance).all(axis=1)], -normals[(heights >= -tolerance).all(axis=1)]]
    )
    faces = {}  # by their corners: a face of many corners is found from each three of them
    for normal in outward:
        height = points @ normal
        faces[tuple(np.flatnonzero(height > height.max() - tolerance).tolist())] = normal
    return [(normal, _ring(points, normal, corners)) for corners, normal in faces.items()]


def _ring(points: Floats, normal: Floats, corners: tuple[int, ...]) -> list[int]:
    """A face's corners in order, counter-clockwise about its normal."""
    across = points[list(corners)] - points[list(corners)].mean(axis=0)
    first = across[0] / np.linalg.norm(across[0])
    angles = np.arctan2(across @ np.cross(normal, first), across @ first)
    return [corners[place] for place in np.argsort(angles)]
