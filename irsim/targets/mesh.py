"""The shape kind `mesh`: a body from a user's mesh file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from irsim.config.base import suggestion
from irsim.config.paths import check_unchanged, with_digest
from irsim.config.quantities import FileName, Fraction, Kelvin, Length
from irsim.geometry.polygon import as_row_differences, centroids, coverage
from irsim.geometry.silhouette import Grid, blur_to_pixels, clip_or_corner
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import POSTURES, Posture, PostureName
from irsim.physics.radiometry import grey_body
from irsim.targets.base import Shape, View, wrong_value
from irsim.targets.meshfile import MAX_CACHED, Triangles, read_mesh
from irsim.targets.parts import Ints
from irsim.targets.rasterize import outline_edges, z_buffer
from irsim.types import Band, Box, Floats

SAMPLES = 3
"""Visibility samples per grid cell along each axis, where faces differ in temperature."""
MIN_SAMPLES = 128
"""Least number of samples across a body, which give each face its share of the light at long range."""
_FINEST_PX = 1e-6
"""Least spacing of samples, px, as a body seen edge-on has no width."""

_AXES: dict[str, tuple[int, int, int]] = {
    # File axes as (forward, right, down), with signs; x forward, y left, z up is the convention of robotics.
    "x forward, z up": (1, -2, -3),
    "y forward, z up": (2, 1, -3),
    "x forward, y up": (1, 3, -2),
    "z forward, y up": (3, -1, -2),
    "-z forward, y up": (-3, 1, -2),
}


class MeshShape(Shape):
    """A body from an OBJ or STL file: a closed surface with one temperature or one for each material.

    The outline is exact, as for all bodies. Faces of different temperature are resolved by samples 1/6 px apart, at
    least 128 across the body. The position of the body is the middle of its bounding box.
    """

    file: FileName
    """Mesh file, .obj or .stl; a relative path is searched beside the scenario, then in the working directory."""
    length_m: Length
    """Length of the longest side of the bounding box, m; the unit of the file does not matter."""
    lies_as: PostureName = "arrow"
    """Attitude along the path. arrow: nose along the velocity; aeroplane, bird: also banks in turns; multirotor,
    helicopter: tilts with speed, turns and braking; vehicle: follows the ground; upright: never tilts."""
    axes: Literal["x forward, z up", "y forward, z up", "x forward, y up", "z forward, y up", "-z forward, y up"] = (
        "x forward, z up"
    )
    """Orientation of the body in the file."""
    temperature_k: Kelvin = 300.0
    """Temperature of materials not listed in `materials_k`, kelvin."""
    materials_k: Mapping[str, Kelvin] = Field(default_factory=dict)
    """Temperatures of materials (OBJ: usemtl, else g or o) by name, kelvin."""
    emissivity: Fraction = 0.95
    """Emissivity of materials not listed in `emissivities`."""
    emissivities: Mapping[str, Fraction] = Field(default_factory=dict)
    """Emissivities of materials by name."""
    digest: str = ""
    """Digest of the mesh file, filled in automatically; a given digest must match the file."""

    @model_validator(mode="before")
    @classmethod
    def _add_digest(cls, given: Any) -> Any:
        return with_digest(given, lambda file: read_mesh(file).digest)

    @model_validator(mode="after")
    def _materials_exist(self) -> MeshShape:
        groups = self.mesh.groups
        named = ((key, name) for key in ("materials_k", "emissivities") for name in getattr(self, key))
        for key, name in named:
            if name not in groups:
                what = f"{self.file} has no material {name!r}; allowed: {', '.join(filter(None, groups)) or 'none'}"
                raise wrong_value(what + suggestion(name, groups), key, name)
        return self

    def __hash__(self) -> int:
        named = tuple(self.materials_k.items()), tuple(self.emissivities.items())
        return hash((self.file, self.length_m, self.axes, self.temperature_k, named))

    @property
    def posture(self) -> Posture:
        return POSTURES[self.lies_as]

    @property
    def mesh(self) -> Triangles:
        """Mesh in the file. Raises InputError if the file changed since the scenario was read."""
        mesh = read_mesh(self.file)
        check_unchanged(self.file, self.digest, mesh.digest)
        return mesh

    @property
    def files(self) -> tuple[Path, ...]:
        return (Path(self.file),)

    @property
    def warning(self) -> tuple[str, str] | None:
        gaps = self.mesh.gaps
        if not gaps:
            return None
        return "file", (
            f"{self.file} is not a closed surface: at {gaps} of its edges a face is missing or inverted; faces are "
            "visible from outside only, so holes may appear"
        )

    def draw(self, view: View) -> Sprite | None:
        context = view.context
        triangles, vertices, normals = _scaled(self, self.mesh)
        points = vertices @ view.attitude.T + view.position
        depth, faces = points[:, 2], triangles.faces
        if depth.min() <= 0:
            return None
        pixels = context.geometry.project(points)
        box = Box.from_edges(*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())
        eye = -view.position @ view.attitude
        front = np.sum(normals * (eye - vertices[faces[:, 0]]), axis=1) > 0
        # A front face is clockwise with x right, y down if its corners are read backwards.
        visible = faces[front][:, ::-1]
        start, stop = outline_edges(pixels, visible)
        grid, ones = Grid.over(clip_or_corner(box, context)), np.ones((len(start), 1))
        area = coverage((start - grid.corner) * grid.fine, (stop - grid.corner) * grid.fine, ones, grid.cells)[:, 0]
        (whole_area,), (center,) = centroids(start, stop, ones)
        glow = _material_radiance(self, triangles.groups, context.band, context.surroundings) * self.brightness(view)
        radiances = glow[triangles.group[front]]
        uniform = not np.ptp(radiances) > 0
        mean = float(radiances[0]) if uniform else _mean_radiance(pixels, depth, visible, radiances, grid)
        light = np.stack([area, area * mean], axis=1)
        centers = (center, _centroid(light[:, 1], grid, center))
        range_m = float(np.linalg.norm(view.position))
        return blur_to_pixels(grid, as_row_differences(light), centers, float(whole_area), box, context.psf, range_m)


def _mean_radiance(pixels: Floats, depth: Floats, faces: Ints, radiances: Floats, grid: Grid) -> Floats:
    """Return the mean radiance (rows, columns) of the faces seen in each cell; a cell without faces takes its
    neighbours'."""
    rows, columns = grid.cells
    window = np.array([grid.columns, grid.rows])
    corners = pixels[faces].reshape(-1, 2) - grid.corner
    low, high = (np.clip(ends, 0, window) for ends in (corners.min(axis=0), corners.max(axis=0)))
    step = np.clip((high - low) / MIN_SAMPLES, _FINEST_PX, 1 / (grid.fine * SAMPLES))
    wide, tall = np.ceil((high - low) / step).astype(np.int64)
    number = z_buffer((pixels - grid.corner - low) / step - 0.5, depth, faces, (tall, wide))
    hit = number >= 0
    light = np.where(hit, radiances[number], 0.0)
    column, row = (
        np.minimum((start + (np.arange(count) + 0.5) * size) * grid.fine, most - 1).astype(np.int64)
        for start, count, size, most in zip(low, (wide, tall), step, (columns, rows), strict=True)
    )
    cell = row[:, None] * columns + column

    def cells(points: Floats) -> Floats:
        sums = np.bincount(cell.ravel(), points.ravel(), rows * columns)
        return np.asarray(sums.reshape(rows, columns), np.float64)

    count, total = cells(hit.astype(np.float64)), cells(light)
    padded = [np.pad(array, 1) for array in (count, total)]
    wide_count, wide_total = (
        np.sum([array[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0) for array in padded
    )
    mean = total.sum() / count.sum() if count.any() else radiances.mean()
    beside = np.where(wide_count > 0, wide_total / np.maximum(wide_count, 1), mean)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), beside))


def _centroid(field: Floats, grid: Grid, default: Floats) -> Floats:
    """Return the centroid (2,) px of a field of areas and moments (3, rows, columns), or `default` if it is dark."""
    area, y_moment, x_moment = field
    light = area.sum()
    if not light > 0:
        return default
    rows, columns = area.shape
    x = (area.sum(axis=0) @ (np.arange(columns) + 0.5) + x_moment.sum()) / light
    y = (area.sum(axis=1) @ (np.arange(rows) + 0.5) + y_moment.sum()) / light
    return np.asarray(grid.corner + np.array([x, y]) / grid.fine)


@lru_cache(maxsize=MAX_CACHED)
def _scaled(shape: MeshShape, triangles: Triangles) -> tuple[Triangles, Floats, Floats]:
    """Return the mesh, its vertices (V, 3) m in body axes about their middle, and outward face normals (F, 3)."""
    own = triangles.vertices[:, np.abs(_AXES[shape.axes]) - 1] * np.sign(_AXES[shape.axes])
    low, high = own.min(axis=0), own.max(axis=0)
    vertices = (own - (low + high) / 2) * (shape.length_m / (high - low).max())
    a, b, c = (vertices[triangles.faces[:, corner]] for corner in range(3))
    return triangles, vertices, np.cross(b - a, c - a)


@lru_cache(maxsize=64)
def _material_radiance(shape: MeshShape, groups: tuple[str, ...], band: Band, surroundings: float) -> Floats:
    """Return the in-band radiance of each material, (groups,), W/m2/sr."""
    temperatures = np.array([shape.materials_k.get(name, shape.temperature_k) for name in groups])
    emissivities = np.array([shape.emissivities.get(name, shape.emissivity) for name in groups])
    return grey_body(band, temperatures, emissivities, surroundings)
