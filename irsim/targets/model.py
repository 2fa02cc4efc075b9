"""A user's own body from a mesh file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import suggestion
from irsim.config.field_annotations import FileName
from irsim.config.file_digests import unchanged, with_digest
from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.geometry.polygon import as_changes, centroids, coverage
from irsim.geometry.silhouette import Grid, spread
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import POSTURES, Posture, PostureName
from irsim.physics.radiometry import grey_body
from irsim.targets.base import Shape, View
from irsim.targets.contours import Ints, contour
from irsim.targets.corners import corners
from irsim.targets.meshfile import REMEMBERED, Triangles, read_mesh
from irsim.targets.rasterize import nearest
from irsim.types import Band, Floats

SAMPLES = 3
"""Points to a cell and axis at which it is asked which face is seen, where faces are of unlike temperature."""
LEAST_SAMPLES = 128
"""Points across a body at least, however few px it has: of a far one, too, each face gives its share of the light."""
_FINEST_PX = 1e-6
"""Points lie no closer: a body seen edge on has no width."""

_AXES: dict[str, tuple[int, int, int]] = {
    # File axes as (forward, right, down), signs apart: x forward, y left, z up is the robotics' way.
    "x forward, z up": (1, -2, -3),
    "y forward, z up": (2, 1, -3),
    "x forward, y up": (1, 3, -2),
    "z forward, y up": (3, -1, -2),
    "-z forward, y up": (-3, 1, -2),
}


class Model(Shape):
    """A body from an OBJ or STL file: a closed surface, in one temperature or one for each material.

    Its outline is exact, like that of all bodies. Where faces of unlike temperature meet, which one is
    seen is asked at points 1/6 px apart, and 128 across at least. It is placed by the middle of its extent.
    """

    file: FileName
    """The mesh, .obj or .stl; a relative name is looked for beside the scenario, then in the working directory."""
    length_m: Length
    """Length of its longest side, m: the file's own unit does not matter."""
    lies_as: PostureName = "arrow"
    """How it lies along its path. arrow: nose along its velocity; aeroplane, bird: so, and it banks in turns;
    multirotor, helicopter: hung from its rotors, which tilt it for speed, turns and braking; vehicle: on the ground;
    upright: it never tilts."""
    axes: Literal["x forward, z up", "y forward, z up", "x forward, y up", "z forward, y up", "-z forward, y up"] = (
        "x forward, z up"
    )
    """How the body lies in the file."""
    temperature_k: Kelvin = 300.0
    """Temperature of all materials that `materials_k` does not name, kelvin."""
    materials_k: Mapping[str, Kelvin] = Field(default_factory=dict)
    """Temperatures of materials (OBJ: usemtl, else g or o) by name, kelvin."""
    emissivity: Fraction = 0.95
    """Of all materials that `emissivities` does not name."""
    emissivities: Mapping[str, Fraction] = Field(default_factory=dict)
    """Emissivities of materials by name."""
    digest: str = ""
    """Of the mesh file's bytes; filled in, and compared where given: a changed mesh is another scene."""

    @model_validator(mode="before")
    @classmethod
    def _look_inside(cls, given: Any) -> Any:
        return with_digest(given, lambda file: read_mesh(file).digest)

    @model_validator(mode="after")
    def _materials_are_known(self) -> Model:
        groups = self.mesh.groups
        named = ((key, name) for key in ("materials_k", "emissivities") for name in getattr(self, key))
        for key, name in named:
            if name not in groups:
                what = f"{self.file} has no material {name!r}; allowed: {', '.join(filter(None, groups)) or 'none'}"
                raise PydanticCustomError(
                    "material", "{what}", {"what": what + suggestion(name, groups), "at": (key, name)}
                )
        return self

    def __hash__(self) -> int:
        named = tuple(self.materials_k.items()), tuple(self.emissivities.items())
        return hash((self.file, self.length_m, self.axes, self.temperature_k, named))

    @property
    def posture(self) -> Posture:
        return POSTURES[self.lies_as]

    @property
    def mesh(self) -> Triangles:
        """What is in its file. InputError where that has changed since the scene was read."""
        mesh = read_mesh(self.file)
        unchanged(self.file, self.digest, mesh.digest)
        return mesh

    @property
    def files(self) -> tuple[Path, ...]:
        return (Path(self.file),)

    @property
    def doubt(self) -> tuple[str, str] | None:
        gaps = self.mesh.gaps
        if not gaps:
            return None
        return "file", (
            f"{self.file} is no closed surface: at {gaps} of its edges a face is missing, or turned the other way; "
            "faces are seen from outside only, so it may be drawn with holes"
        )

    def draw(self, view: View) -> Sprite | None:
        context = view.context
        triangles, vertices, normals = _placed(self, self.mesh)
        placed = corners(vertices, view)
        if placed is None:
            return None
        pixels, faces = placed.pixels, triangles.faces
        front = np.sum(normals * (placed.eye - vertices[faces[:, 0]]), axis=1) > 0
        # A face seen from outside runs clockwise with x right, y down where its corners are read backwards.
        seen = faces[front][:, ::-1]
        start, stop = contour(pixels, seen)
        grid = Grid.over(placed.window)
        area = coverage(
            (start - grid.corner) * grid.fine, (stop - grid.corner) * grid.fine, np.ones((len(start), 1)), grid.cells
        )[:, 0]
        [[whole_area]], [[center]] = centroids(start, stop, np.ones((len(start), 1)), np.array([len(start)]))
        glow = _glow(self, triangles.groups, context.band, context.surroundings) * self.brightness(view)
        shades = glow[triangles.group[front]]
        shine = _shine(pixels, placed.depth, seen, shades, grid) if np.ptp(shades) > 0 else float(shades[0])
        light = np.stack([area, area * shine], axis=1)
        range_m = float(np.linalg.norm(view.position))
        centers = (center, _middle(light[:, 1], grid, center))
        return spread(grid, as_changes(light), centers, float(whole_area), placed.box, context.psf, range_m)


def _shine(pixels: Floats, depth: Floats, faces: Ints, shades: Floats, grid: Grid) -> Floats:
    """(rows, columns) mean glow of what is seen in each cell; of what is seen nearby where no point meets a face."""
    rows, columns = grid.cells
    window = np.array([grid.columns, grid.rows])
    corners = pixels[faces].reshape(-1, 2) - grid.corner
    low, high = (np.clip(ends, 0, window) for ends in (corners.min(axis=0), corners.max(axis=0)))
    step = np.clip((high - low) / LEAST_SAMPLES, _FINEST_PX, 1 / (grid.fine * SAMPLES))
    wide, tall = np.ceil((high - low) / step).astype(np.int64)
    number = nearest((pixels - grid.corner - low) / step - 0.5, depth, faces, (tall, wide))
    hit = number >= 0
    light = np.where(hit, shades[number], 0.0)
    column, row = (
        np.minimum((start + (np.arange(count) + 0.5) * size) * grid.fine, most - 1).astype(np.int64)
        for start, count, size, most in zip(low, (wide, tall), step, (columns, rows), strict=True)
    )
    cell = row[:, None] * columns + column

    def cells(points: Floats) -> Floats:
        sums = np.bincount(cell.ravel(), points.ravel(), rows * columns)
        return np.asarray(sums.reshape(rows, columns), np.float64)

    count, total = cells(hit.astype(np.float64)), cells(light)
    around = [np.pad(array, 1) for array in (count, total)]
    wide_count, wide_total = (
        np.sum([array[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0) for array in around
    )
    mean = total.sum() / count.sum() if count.any() else shades.mean()
    beside = np.where(wide_count > 0, wide_total / np.maximum(wide_count, 1), mean)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), beside))


def _middle(field: Floats, grid: Grid, otherwise: Floats) -> Floats:
    """Centroid (2,) px of a field's areas and moments (3, rows, columns); `otherwise` where it is dark."""
    area, y_moment, x_moment = field
    light = area.sum()
    if not light > 0:
        return otherwise
    rows, columns = area.shape
    x = (area.sum(axis=0) @ (np.arange(columns) + 0.5) + x_moment.sum()) / light
    y = (area.sum(axis=1) @ (np.arange(rows) + 0.5) + y_moment.sum()) / light
    return np.asarray(grid.corner + np.array([x, y]) / grid.fine)


@lru_cache(maxsize=REMEMBERED)
def _placed(model: Model, triangles: Triangles) -> tuple[Triangles, Floats, Floats]:
    """The mesh, its vertices (V, 3) m in body axes about their middle, and its faces' outward normals (F, 3)."""
    own = triangles.vertices[:, np.abs(_AXES[model.axes]) - 1] * np.sign(_AXES[model.axes])
    low, high = own.min(axis=0), own.max(axis=0)
    vertices = (own - (low + high) / 2) * (model.length_m / (high - low).max())
    a, b, c = (vertices[triangles.faces[:, corner]] for corner in range(3))
    return triangles, vertices, np.cross(b - a, c - a)


@lru_cache(maxsize=64)
def _glow(model: Model, groups: tuple[str, ...], band: Band, surroundings: float) -> Floats:
    """(groups,) in-band radiance, W/m2/sr."""
    temperatures = np.array([model.materials_k.get(name, model.temperature_k) for name in groups])
    emissivities = np.array([model.emissivities.get(name, model.emissivity) for name in groups])
    return grey_body(band, temperatures, emissivities, surroundings)
