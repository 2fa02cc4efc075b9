"""Bodies: shapes made of convex parts, drawn exactly for any attitude and range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from irsim._native import COMPILED, kernels
from irsim.config.base import suggestion
from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.geometry.silhouette import FINENESS, draw_sprite, psf_table
from irsim.geometry.sprite import Sprite
from irsim.physics.psf import PSF
from irsim.physics.radiometry import grey_body
from irsim.targets.base import Shape, View, wrong_value
from irsim.targets.parts import RigidTransform, Solid
from irsim.targets.polyhedra import Polyhedra, build_polyhedra
from irsim.targets.visibility import Joints, part_outlines, split_intersections
from irsim.types import Band, Box, Floats


class Body(Shape):
    """A body of convex parts, each with its own temperature and emissivity.

    The material of a part is named by a temperature key, such as `engine_k`. Its emissivity is the value of the key
    `engine_emissivity` if the body has this key, else the entry `engine` of `emissivities`, else `emissivity`.

    Each part is drawn by the exact outline of its convex hull, and parts hide each other in depth order
    (`Polyhedra.depth_order`). Intersecting parts of different material are split first (`split_intersections`). Parts
    on different joints and parts that would become many pieces stay whole: a change of their depth order changes the
    light of a shipped body by less than 1 %.
    """

    solids: ClassVar[tuple[Solid, ...]]
    """Parts of the body, with lengths in units of the body's length."""

    length_m: Length
    """Length, m."""
    temperature_k: Kelvin = 300.0
    """Temperature of the skin, kelvin."""
    emissivity: Fraction = 0.95
    """Emissivity of all parts without a more specific one."""
    emissivities: Mapping[str, Fraction] = Field(default_factory=dict)
    """Emissivities of parts, by the key of their temperature without `_k`: {engine: 0.8}."""

    @model_validator(mode="after")
    def _parts_exist(self) -> Body:
        names = (_name(solid) for solid in self.solids if _own_emissivity(self, solid) is None)
        allowed = list(dict.fromkeys(name for name in names if name != _SKIN))
        for name in self.emissivities:
            if name not in allowed:
                what = f"{name!r} is no part whose emissivity is set here; allowed: {', '.join(allowed) or 'none'}"
                raise wrong_value(what + suggestion(name, allowed), "emissivities", name)
        return self

    def __hash__(self) -> int:
        return hash((type(self), self.length_m, self.temperature_k))  # quick: computed for each body and frame

    def __eq__(self, other: object) -> bool:
        # Five times as fast as pydantic's.
        return self is other or (type(self) is type(other) and vars(self) == vars(other))

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        """Return the transforms of the joints at a time, s, with translations in body lengths."""
        return {}

    def draw(self, view: View) -> Sprite | None:
        return draw_body(self.posed(view))

    def posed(self, view: View) -> PosedBody:
        """Return the body in the pose of a view."""
        rest = _rest_pose(self, view.context.band, view.context.surroundings)
        transforms = self.joints(view.time) if rest.joints.names else {}
        return PosedBody(rest, transforms, self.length_m, view, self.brightness(view))


@dataclass(frozen=True, eq=False)
class RestPose:
    """A body at rest: its polyhedra, its joints, and the radiance of each part (n,), W/m2/sr."""

    polyhedra: Polyhedra
    joints: Joints
    glow: Floats

    @cached_property
    def table(self) -> kernels.Form:
        """Tables for the compiled kernel."""
        body, topology = self.polyhedra, self.polyhedra.topology
        tables = topology.firsts, topology.corner, topology.edges, topology.material
        planes = body.vertices, body.normals, body.offsets, body.penetration
        return kernels.form(*tables, *planes, body.thin, self.joints.of_part)


class PosedBody(NamedTuple):
    """A body in a view: `transforms` of the joints have translations in units of `scale`, the body's length in m."""

    rest: RestPose
    transforms: Mapping[str, RigidTransform]
    scale: float
    view: View
    brightness: float


def draw_body(body: PosedBody) -> Sprite | None:
    """Draw a body; None if any part lies behind the camera."""
    if COMPILED:
        return _draw_compiled(body)
    rest, transforms, scale, view, brightness = body
    polygons = part_outlines(rest.polyhedra, rest.joints, transforms, scale, view, rest.glow * brightness)
    return None if polygons is None else draw_sprite(polygons)


def _draw_compiled(body: PosedBody) -> Sprite | None:
    rest, transforms, scale, view, brightness = body
    context = view.context
    geometry = context.geometry
    (columns, rows), (right, down) = geometry.size, geometry.shift_px
    found = kernels.body_light(
        rest.table,
        tuple([transforms[name].numbers for name in rest.joints.names]),
        scale,
        view.position,
        view.attitude,
        geometry.ifov_rad,
        columns,
        rows,
        right,
        down,
        rest.glow,
        brightness,
        _psf_tables(context.psf),
    )
    if found is None:
        return None
    x0, y0, shape, light, center, signal_center, box, range_m, area = found
    planes = np.ndarray(shape, np.float64, light)  # indexing takes half the time of unpacking
    return Sprite(x0, y0, planes[0], planes[1], planes[2], center, signal_center, Box(*box), range_m, area)


@lru_cache(maxsize=32)
def _psf_tables(psf: PSF) -> tuple[tuple[float, kernels.Spread], ...]:
    """Return the largest side of a body, px, and the table of a PSF for each fineness of the drawing grid
    (`FINENESS`)."""
    return tuple((limit, psf_table(psf, fine)) for limit, fine in FINENESS)


_SKIN = "temperature"


def _name(solid: Solid) -> str:
    return solid.material.removesuffix("_k")


def _own_emissivity(body: Body, solid: Solid) -> float | None:
    """Return the emissivity that the body's key for the part's material gives; None if the body has no such key."""
    found: float | None = getattr(body, f"{_name(solid)}_emissivity", None)
    return found


@lru_cache(maxsize=64)
def _split_parts(body: type[Body]) -> tuple[Solid, ...]:
    return split_intersections(body.solids)


@lru_cache(maxsize=64)
def _joints(body: type[Body]) -> Joints:
    parts = _split_parts(body)
    names = tuple(sorted({solid.joint for solid in parts if solid.joint}))
    return Joints(names, np.array([names.index(solid.joint) if solid.joint else -1 for solid in parts], np.int64))


@lru_cache(maxsize=64)
def _polyhedra(body: type[Body], length_m: float) -> Polyhedra:
    return build_polyhedra(_split_parts(body), length_m)


@lru_cache(maxsize=64)
def _rest_pose(body: Body, band: Band, surroundings: float) -> RestPose:
    kind = type(body)
    return RestPose(_polyhedra(kind, body.length_m), _joints(kind), _radiance(body, band, surroundings))


def _radiance(body: Body, band: Band, surroundings: float) -> Floats:
    """Return the in-band radiance of each part, (parts,), W/m2/sr."""
    parts = _split_parts(type(body))
    temperatures = np.array([getattr(body, solid.material) for solid in parts])
    own = (_own_emissivity(body, solid) for solid in parts)
    others = (body.emissivities.get(_name(solid), body.emissivity) for solid in parts)
    emissivities = np.array([one if one is not None else other for one, other in zip(own, others, strict=True)])
    return grey_body(band, temperatures, emissivities, surroundings)
