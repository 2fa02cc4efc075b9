"""Several convex polyhedra: their faces, edges, and which of them hides which."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import cast

import numpy as np
import numpy.typing as npt

from irsim.targets.hull import Hull, Ints, hull
from irsim.targets.joints import Rigid
from irsim.targets.solids import Solid
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Parts:
    """How vertices, faces and edges of several convex polyhedra hang together, however they lie.

    Vertices (V,) and faces (F,) are of parts `vertex_part` and `face_part`, those of one part side by
    side; vertex `corner` (F,) is one of each face's own. Each edge (E,) of part `part` runs from vertex
    `tail` to `head` with its face `left` counter-clockwise as seen from outside, `right` on its other side.
    Parts of the same number in `heat` (parts,) shine alike: which of them hides which does not matter.
    """

    vertex_part: Ints
    face_part: Ints
    corner: Ints
    tail: Ints
    head: Ints
    left: Ints
    right: Ints
    part: Ints
    heat: Ints

    @property
    def count(self) -> int:
        return len(self.starts)

    @cached_property
    def starts(self) -> Ints:
        """(parts,) first vertex of each part."""
        return np.flatnonzero(np.diff(self.vertex_part, prepend=-1))

    @cached_property
    def firsts(self) -> Ints:
        """(2, parts + 1) first vertex and first face of each part, and how many there are of all."""
        return np.stack(
            [np.append(np.flatnonzero(np.diff(of, prepend=-1)), len(of)) for of in (self.vertex_part, self.face_part)]
        )

    @cached_property
    def edges(self) -> Ints:
        """(E, 5) tail, head, left, right and part of each edge."""
        return np.column_stack([self.tail, self.head, self.left, self.right, self.part])

    @cached_property
    def all(self) -> Some:
        """All of them."""
        return self.some(tuple(range(self.count)))

    def some(self, parts: tuple[int, ...]) -> Some:
        """Some of them."""
        return _some(self, parts)

    @cached_property
    def owner(self) -> npt.NDArray[np.float32]:
        """(F, parts) 1 where a face is of a part, so that a product with it sums over each part's faces."""
        belongs = self.face_part[:, None] == np.arange(self.count)
        return cast(npt.NDArray[np.float32], belongs.astype(np.float32))

    @cached_property
    def faces(self) -> Ints:
        """(parts, most) faces of each part, the last one again where it has fewer than others."""
        counts = np.bincount(self.face_part)
        begins = np.cumsum(counts) - counts
        return np.asarray(begins[:, None] + np.minimum(np.arange(counts.max()), counts[:, None] - 1))

    @cached_property
    def later(self) -> npt.NDArray[np.bool_]:
        """(parts, parts) is the second part's number the greater one?"""
        return np.triu(np.ones((self.count, self.count), dtype=bool), 1)

    @cached_property
    def unlike(self) -> npt.NDArray[np.bool_]:
        """(parts, parts) are they of unlike heat?"""
        return np.asarray(self.heat[:, None] != self.heat)


@dataclass(frozen=True, eq=False)
class Some:
    """Some of the parts, numbers (n,) rising: their vertices and faces, whose each is: 0 .. n-1, and `alike`, those
    with as many vertices as each other: which they are, and their vertices (m, count), counted from the first of all.
    """

    parts: Ints
    vertices: Ints
    faces: Ints
    whose_vertex: Ints
    whose_face: Ints
    alike: tuple[tuple[Ints, Ints], ...]

    def crossing(self, vertices: Floats, normals: Floats, offsets: Floats) -> Floats:
        """(n, planes) how far each reaches, their vertices being there, behind planes normal . v = offset."""
        heights = vertices @ normals.T
        lowest = np.empty((len(self.parts), len(normals)))
        for which, corners in self.alike:
            lowest[which] = heights[corners].min(axis=1)
        return np.asarray(offsets - lowest)


@lru_cache(maxsize=64)
def _some(parts: Parts, some: tuple[int, ...]) -> Some:
    place = np.full(parts.count, -1)
    place[list(some)] = np.arange(len(some))
    vertices, faces = (np.flatnonzero(place[of] >= 0) for of in (parts.vertex_part, parts.face_part))
    whose = place[parts.vertex_part[vertices]]
    counts = np.bincount(whose)
    starts = np.cumsum(counts) - counts
    alike = tuple(
        (which, starts[which][:, None] + np.arange(count))
        for count in np.unique(counts).tolist()
        for which in [np.flatnonzero(counts == count)]
    )
    return Some(np.array(some), vertices, faces, whose, place[parts.face_part[faces]], alike)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Several convex polyhedra as they lie.

    vertices (V, 3); normals (F, 3) outward and offsets (F,): a face's plane is normal . v = offset.
    crossing (parts, F): how far each part reaches behind each face's plane.
    """

    parts: Parts
    vertices: Floats
    normals: Floats
    offsets: Floats
    crossing: Floats

    @cached_property
    def thin(self) -> float:
        """What reaches no farther behind a face lies wholly before it, but for rounding."""
        return float(1e-9 * self.crossing.max())

    @cached_property
    def outside(self) -> npt.NDArray[np.float32]:
        """(parts, F) 1 where a part lies wholly before a face."""
        return cast(npt.NDArray[np.float32], (self.crossing <= self.thin).astype(np.float32))

    @cached_property
    def parting(self) -> npt.NDArray[np.float32]:
        """(parts, parts) how many faces of the second the first lies wholly before."""
        return cast(npt.NDArray[np.float32], self.outside @ self.parts.owner)

    @cached_property
    def walls(self) -> tuple[Ints, npt.NDArray[np.bool_]]:
        """(parts, parts) twice: the wall of two parts, that face of either which the other crosses least, and is it
        the second's?"""
        faces, part = self.parts.faces, np.arange(self.parts.count)
        least = faces[part, np.argmin(self.crossing[:, faces], axis=2)]
        crossed = self.crossing[part[:, None], least]
        of_second = crossed <= crossed.T
        return np.where(of_second, least, least.T), np.asarray(of_second)

    def hiding_order(self, eye: Floats, pixels: Floats) -> Ints:
        """(parts,) rank of each part as seen from `eye` (3,), vertices at pixels (V, 2): nothing hides the first.

        Where a face's plane parts two parts, the one beyond it from the eye does not hide the other; where
        no plane parts them, that of their wall says which does. Only parts of unlike heat whose boxes meet in the
        picture count. A part comes after all that hide it, and those that hide these.
        """
        parts = self.parts
        to_eye = self.normals @ eye > self.offsets
        before = (self.outside * to_eye) @ parts.owner
        cannot = (before.T > 0) | (self.parting > before)  # (hider, hidden)
        low, high = np.minimum.reduceat(pixels, parts.starts), np.maximum.reduceat(pixels, parts.starts)
        meet = (low[:, None, 0] <= high[:, 0]) & (low[:, None, 1] <= high[:, 1])
        meet = meet & meet.T & parts.unlike
        first, second = np.nonzero(meet & parts.later & ~(cannot | cannot.T))
        wall, of_second = self.walls
        nearer = to_eye[wall[first, second]] == of_second[first, second]  # is the first on the eye's side of it?
        cannot[np.where(nearer, second, first), np.where(nearer, first, second)] = True
        hides = (meet & ~cannot).astype(np.float32)
        for _ in range(parts.count.bit_length()):  # each time chains of twice the length
            hides = np.minimum(hides + hides @ hides, 1.0)
        rank = np.empty(parts.count, dtype=np.int64)
        rank[np.argsort(hides.sum(axis=0), kind="stable")] = np.arange(parts.count)
        return rank

    def posed(self, motions: Mapping[int, Rigid], scale: float) -> Mesh:
        """The same with some parts moved: by part, in units of `scale`."""
        if not motions:
            return self
        parts, names = self.parts, tuple(sorted(motions))
        moved = parts.some(names)
        turns = np.array([motions[part].turn for part in names])
        shifts = np.array([motions[part].shift for part in names]) * scale
        vertices, normals, offsets, crossing = (
            each.copy() for each in (self.vertices, self.normals, self.offsets, self.crossing)
        )
        own, face = moved.vertices, moved.faces
        turned = (turns[moved.whose_vertex] @ vertices[own, :, None])[..., 0]
        vertices[own] = turned + shifts[moved.whose_vertex]
        normals[face] = (turns[moved.whose_face] @ normals[face, :, None])[..., 0]
        offsets[face] = np.sum(normals[face] * vertices[parts.corner[face]], axis=1)
        # What neither a part nor a face that moves is concerned with stays.
        crossing[:, face] = parts.all.crossing(vertices, normals[face], offsets[face])
        crossing[moved.parts] = moved.crossing(vertices[own], normals, offsets)
        return Mesh(parts, vertices, normals, offsets, crossing)


def mesh(solids: tuple[Solid, ...], scale: float) -> Mesh:
    """The convex hulls of solids, their lengths times `scale`. Raises ValueError where one has no volume."""
    hulls = [_hull(part, solid) for part, solid in enumerate(solids)]
    counts = np.array([(len(each.vertices), len(each.normals), len(each.edges)) for each in hulls])
    vertex_part, face_part, part = (np.repeat(np.arange(len(hulls)), count) for count in counts.T)
    before = np.cumsum(counts, axis=0) - counts  # vertices, faces and edges of the parts before each
    corner = np.concatenate([each.corner for each in hulls]) + before[face_part, 0]
    tail, head, left, right = (np.concatenate([each.edges for each in hulls]) + before[part][:, [0, 0, 1, 1]]).T
    heat = np.unique([solid.heat for solid in solids], return_inverse=True)[1].astype(np.int64)
    parts = Parts(vertex_part, face_part, corner, tail, head, left, right, part, heat)
    places = np.concatenate([each.vertices for each in hulls]) * scale
    planes = np.concatenate([each.normals for each in hulls])
    offsets = np.sum(planes * places[corner], axis=1)
    return Mesh(parts, places, planes, offsets, parts.all.crossing(places, planes, offsets))


def _hull(part: int, solid: Solid) -> Hull:
    try:
        return hull(solid.points)
    except ValueError as error:
        raise ValueError(f"solid {part} has {error}") from None
