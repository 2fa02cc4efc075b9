"""Several convex polyhedra: their faces, edges, and which of them hides which."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from irsim.shapes.joints import Rigid
from irsim.shapes.solids import Solid
from irsim.types import Floats

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Several convex polyhedra, the parts.

    vertices (V, 3) of parts `vertex_part` (V,); normals (F, 3) outward and offsets (F,), of parts
    `face_part` (F,): a face's plane is normal . v = offset, and vertex `corner` (F,) is one of its own.
    Each edge runs from vertex `tail` to `head` with its face `left` counter-clockwise as seen from
    outside, `right` on its other side; `part` (E,) is the part it belongs to.
    outside (parts, F) says which parts lie wholly before which faces.
    For each pair of parts a plane parts them as well as any face of theirs can: `first` is on the
    side that `walls` (pairs, 3) point to from `reaches` (pairs,), `second` on the other.
    """

    vertices: Floats
    vertex_part: Ints
    normals: Floats
    offsets: Floats
    face_part: Ints
    corner: Ints
    tail: Ints
    head: Ints
    left: Ints
    right: Ints
    part: Ints
    first: Ints
    second: Ints
    walls: Floats
    reaches: Floats
    outside: npt.NDArray[np.bool_]

    def hiding_order(self, eye: Floats, pixels: Floats) -> Ints:
        """(parts,) rank of each part as seen from `eye` (3,), vertices at pixels (V, 2): nothing hides the first.

        Where a face's plane parts two parts, the one beyond it from the eye does not hide the other; where
        no plane parts them, that of their wall says which does. Only parts whose boxes meet in the picture
        count. A part comes after all that hide it, and those that hide these.
        """
        starts = np.flatnonzero(np.diff(self.vertex_part, prepend=-1))
        owner = (self.face_part[:, None] == np.arange(len(starts))).astype(np.float32)
        beside = self.outside.astype(np.float32)
        to_eye = self.normals @ eye > self.offsets
        cannot = ((beside * to_eye) @ owner).T + (beside * ~to_eye) @ owner > 0  # (hider, hidden)
        nearer = self.walls @ eye > self.reaches
        cannot[np.where(nearer, self.second, self.first), np.where(nearer, self.first, self.second)] |= ~(
            cannot[self.first, self.second] | cannot[self.second, self.first]
        )
        low, high = np.minimum.reduceat(pixels, starts), np.maximum.reduceat(pixels, starts)
        meet = (low[:, None, 0] <= high[:, 0]) & (low[:, None, 1] <= high[:, 1])
        hides = (meet & meet.T & ~cannot).astype(np.float32)
        np.fill_diagonal(hides, 0.0)
        for _ in range(len(starts).bit_length()):  # each time chains of twice the length
            hides = np.minimum(hides + hides @ hides, 1.0)
        rank = np.empty(len(starts), dtype=np.int64)
        rank[np.argsort(hides.sum(axis=0), kind="stable")] = np.arange(len(starts))
        return rank

    def posed(self, motions: Mapping[int, Rigid], scale: float) -> Mesh:
        """The same with some parts moved: by part, in units of `scale`."""
        if not motions:
            return self
        turns = np.tile(np.eye(3), (int(self.part[-1]) + 1, 1, 1))
        shifts = np.zeros((len(turns), 3))
        for part, motion in motions.items():
            turns[part], shifts[part] = motion.turn, motion.shift * scale
        vertices = np.einsum("vij,vj->vi", turns[self.vertex_part], self.vertices) + shifts[self.vertex_part]
        normals = np.einsum("fij,fj->fi", turns[self.face_part], self.normals)
        offsets = np.sum(normals * vertices[self.corner], axis=1)
        walls, reaches, outside = _walls(
            vertices, self.vertex_part, normals, offsets, self.face_part, self.first, self.second
        )
        return replace(
            self,
            vertices=vertices,
            normals=normals,
            offsets=offsets,
            walls=walls,
            reaches=reaches,
            outside=outside,
        )


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
    vertex_part = np.repeat(np.arange(len(solids)), [len(points) for points in vertices])
    tail, head, left, right, owner = np.array(edges).T
    planes, face_part = np.array(normals), np.array(owners)
    corner = np.empty(len(planes), dtype=np.int64)
    corner[left] = corner[right] = tail
    offsets = np.sum(planes * places[corner], axis=1)
    pairs = np.array(list(combinations(range(len(solids)), 2)), dtype=np.int64).reshape(-1, 2)
    walls, reaches, outside = _walls(places, vertex_part, planes, offsets, face_part, *pairs.T)
    return Mesh(
        vertices=places,
        vertex_part=vertex_part,
        normals=planes,
        offsets=offsets,
        face_part=face_part,
        corner=corner,
        tail=tail,
        head=head,
        left=left,
        right=right,
        part=owner,
        first=pairs[:, 0],
        second=pairs[:, 1],
        walls=walls,
        reaches=reaches,
        outside=outside,
    )


def _walls(
    vertices: Floats,
    vertex_part: Ints,
    normals: Floats,
    offsets: Floats,
    face_part: Ints,
    first: Ints,
    second: Ints,
) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Of each pair of parts the face of either that the other crosses least, as a plane that points to the first.

    Normals (pairs, 3) and offsets (pairs,), and which parts lie wholly before which faces (parts, faces).
    """
    starts = np.flatnonzero(np.diff(vertex_part, prepend=-1))
    heights = np.minimum.reduceat(vertices @ normals.T, starts, axis=0)
    crossing = offsets - heights  # (parts, faces): how far a part reaches behind a face
    counts = np.bincount(face_part)
    begins = np.cumsum(counts) - counts
    faces = begins[:, None] + np.minimum(np.arange(counts.max()), counts[:, None] - 1)  # (parts, most faces)
    pick = np.argmin(crossing[:, faces], axis=2)
    least = faces[np.arange(len(faces)), pick]  # (parts, parts): the face of the second that the first crosses least
    by_second, by_first = least[first, second], least[second, first]
    own = crossing[first, by_second] <= crossing[second, by_first]
    face, sign = np.where(own, by_second, by_first), np.where(own, 1.0, -1.0)
    return normals[face] * sign[:, None], offsets[face] * sign, crossing <= 1e-9 * crossing.max()


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
