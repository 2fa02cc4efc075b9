"""Convex polyhedra: an assembly of convex parts in a pose, and the depth order of the parts from a viewpoint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
import numpy.typing as npt

from irsim.targets.parts import Hull, Ints, RigidTransform, Solid, convex_hull
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Topology:
    """Pose-independent connectivity of several convex polyhedra.

    vertex_part  (V,) part of each vertex; vertices of one part are contiguous
    face_part    (F,) part of each face; faces of one part are contiguous
    corner       (F,) one vertex of each face
    edges        (E, 5) tail vertex, head vertex, left face, right face and part of each edge; the left face is
                 counter-clockwise along it as seen from outside
    material     (parts,) material number; the depth order of parts of equal material does not matter
    """

    vertex_part: Ints
    face_part: Ints
    corner: Ints
    edges: Ints
    material: Ints

    @property
    def count(self) -> int:
        """Number of parts."""
        return len(self.material)

    @cached_property
    def firsts(self) -> Ints:
        """(2, parts + 1) first vertex and first face of each part, and their total numbers."""
        return np.stack(
            [np.append(np.flatnonzero(np.diff(of, prepend=-1)), len(of)) for of in (self.vertex_part, self.face_part)]
        )

    @cached_property
    def owner(self) -> npt.NDArray[np.float32]:
        """(F, parts) matrix, 1 where a face belongs to a part; a product with it sums over each part's faces."""
        belongs = self.face_part[:, None] == np.arange(self.count)
        return cast(npt.NDArray[np.float32], belongs.astype(np.float32))

    @cached_property
    def faces(self) -> Ints:
        """(parts, largest number of faces) numbers of the faces of each part, padded with that of its last face."""
        begins, counts = self.firsts[1, :-1], np.diff(self.firsts[1])
        return np.asarray(begins[:, None] + np.minimum(np.arange(counts.max()), counts[:, None] - 1))

    @cached_property
    def different_material(self) -> npt.NDArray[np.bool_]:
        """(parts, parts) matrix, True where the materials of two parts differ."""
        return np.asarray(self.material[:, None] != self.material)

    def penetration(self, vertices: Floats, normals: Floats, offsets: Floats) -> Floats:
        """Return the depth (parts, F) to which each part reaches behind the plane of each face."""
        return np.asarray(offsets - np.minimum.reduceat(vertices @ normals.T, self.firsts[0, :-1], axis=0))


@dataclass(frozen=True, eq=False)
class Polyhedra:
    """Several convex polyhedra in one pose.

    topology     connectivity
    vertices     (V, 3)
    normals      (F, 3) outward normals; a face's plane is normal . v = offset
    offsets      (F,)
    penetration  (parts, F) depth to which each part reaches behind each face's plane
    """

    topology: Topology
    vertices: Floats
    normals: Floats
    offsets: Floats
    penetration: Floats

    @cached_property
    def thin(self) -> float:
        """Rounding tolerance of `penetration`: at or below it a part lies wholly in front of a face."""
        return float(1e-9 * self.penetration.max())

    @cached_property
    def in_front(self) -> npt.NDArray[np.float32]:
        """(parts, F) matrix, 1 where a part lies wholly in front of a face."""
        return cast(npt.NDArray[np.float32], (self.penetration <= self.thin).astype(np.float32))

    @cached_property
    def separating(self) -> npt.NDArray[np.float32]:
        """(parts, parts) number of faces of the second part that the first lies wholly in front of."""
        return cast(npt.NDArray[np.float32], self.in_front @ self.topology.owner)

    @cached_property
    def least_penetrated(self) -> tuple[Ints, npt.NDArray[np.bool_]]:
        """(parts, parts) least penetrated face of each pair of parts, and True where this face belongs to the second
        part."""
        faces, part = self.topology.faces, np.arange(self.topology.count)
        least = faces[part, np.argmin(self.penetration[:, faces], axis=2)]
        crossed = self.penetration[part[:, None], least]
        of_second = crossed <= crossed.T
        return np.where(of_second, least, least.T), np.asarray(of_second)

    def depth_order(self, eye: Floats, pixels: Floats) -> Ints:
        """Return the rank (parts,) of each part in depth order as seen from `eye` (3,); rank 0 is the nearest.

        pixels  (V, 2) projected vertices

        If the plane of a face separates two parts, the one beyond it as seen from the eye cannot hide the other;
        without such a plane the least penetrated face decides. Only parts of different material with overlapping
        bounding boxes count. A part follows all parts that hide it, directly or through others.
        """
        topology = self.topology
        to_eye = self.normals @ eye > self.offsets
        before = (self.in_front * to_eye) @ topology.owner
        cannot = (before.T > 0) | (self.separating > before)  # (hider, hidden)
        low, high = (ends.reduceat(pixels, topology.firsts[0, :-1]) for ends in (np.minimum, np.maximum))
        meet = (low[:, None, 0] <= high[:, 0]) & (low[:, None, 1] <= high[:, 1])
        meet = meet & meet.T & topology.different_material
        first, second = np.nonzero(np.triu(meet & ~(cannot | cannot.T), 1))
        face, of_second = self.least_penetrated
        nearer = to_eye[face[first, second]] == of_second[first, second]  # True if the first part is on the eye's side
        cannot[np.where(nearer, second, first), np.where(nearer, first, second)] = True
        hides = (meet & ~cannot).astype(np.float32)
        for _ in range(topology.count.bit_length()):  # transitive closure: chains double in length each time
            hides = np.minimum(hides + hides @ hides, 1.0)
        rank = np.empty(topology.count, dtype=np.int64)
        rank[np.argsort(hides.sum(axis=0), kind="stable")] = np.arange(topology.count)
        return rank

    def posed(self, transforms: Mapping[int, RigidTransform], scale: float) -> Polyhedra:
        """Return the polyhedra with some parts moved by transforms with translations in units of `scale`."""
        if not transforms:
            return self
        topology = self.topology
        vertices, normals = self.vertices.copy(), self.normals.copy()
        for part, transform in transforms.items():
            own, face = topology.vertex_part == part, topology.face_part == part
            vertices[own] = vertices[own] @ transform.rotation.T + transform.translation * scale
            normals[face] = normals[face] @ transform.rotation.T
        return _polyhedra(topology, vertices, normals)


def _polyhedra(topology: Topology, vertices: Floats, normals: Floats) -> Polyhedra:
    offsets = np.sum(normals * vertices[topology.corner], axis=1)
    return Polyhedra(topology, vertices, normals, offsets, topology.penetration(vertices, normals, offsets))


def build_polyhedra(solids: tuple[Solid, ...], scale: float) -> Polyhedra:
    """Return the convex hulls of solids scaled by `scale`. Raises ValueError if one encloses no volume."""
    hulls = [_part_hull(part, solid) for part, solid in enumerate(solids)]
    counts = np.array([(len(each.vertices), len(each.normals), len(each.edges)) for each in hulls])
    vertex_part, face_part, part = (np.repeat(np.arange(len(hulls)), count) for count in counts.T)
    before = np.cumsum(counts, axis=0) - counts  # offsets of vertices, faces and edges of each part
    corner = np.concatenate([each.corner for each in hulls]) + before[face_part, 0]
    ends = np.concatenate([each.edges for each in hulls]) + before[part][:, [0, 0, 1, 1]]
    material = np.unique([solid.material for solid in solids], return_inverse=True)[1].astype(np.int64)
    topology = Topology(vertex_part, face_part, corner, np.column_stack([ends, part]), material)
    vertices = np.concatenate([each.vertices for each in hulls]) * scale
    return _polyhedra(topology, vertices, np.concatenate([each.normals for each in hulls]))


def _part_hull(part: int, solid: Solid) -> Hull:
    try:
        return convex_hull(solid.points)
    except ValueError as error:
        raise ValueError(f"solid {part} has {error}") from None
