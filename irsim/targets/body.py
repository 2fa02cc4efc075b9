"""Three-dimensional bodies: a table of convex parts, drawn by attitude and range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim._native import COMPILED
from irsim.config.base import suggestion
from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.geometry.sprite import Sprite
from irsim.physics.radiometry import grey_body
from irsim.targets.base import Shape, View
from irsim.targets.joints import Rigid
from irsim.targets.mesh import Mesh, mesh
from irsim.targets.part_outlines import Joints
from irsim.targets.posed import Posed, Rest, posed_sprite, posed_sprites
from irsim.targets.solids import Solid
from irsim.targets.split_intersections import parted
from irsim.types import Band, Floats


class Body(Shape):
    """A body of convex parts, each with its own temperature and emissivity.

    A part's heat is the name of a key, such as `engine_k`; the emissivity of those parts is the key
    `engine_emissivity` where the body has one, else what `emissivities` says of `engine`, else `emissivity`.

    A part is drawn as the outline that its hull has from where the camera is, exactly, and parts hide
    each other in the order of `Mesh.hiding_order`. Solids of unlike heat that run into each other are
    cut for it (`parted`), but for those on unlike joints and those that would become many pieces: at
    attitudes at which their order changes, the light of a shipped body jumps by less than 1 %.
    """

    solids: ClassVar[tuple[Solid, ...]]
    """The parts, for a body of length 1."""

    length_m: Length
    """Length, m."""
    temperature_k: Kelvin = 300.0
    """Temperature of the skin, kelvin."""
    emissivity: Fraction = 0.95
    """Of all parts of which nothing else says it."""
    emissivities: Mapping[str, Fraction] = Field(default_factory=dict)
    """Emissivities of parts, by the key of their temperature without `_k`: {engine: 0.8}."""

    @model_validator(mode="after")
    def _parts_are_there(self) -> Body:
        names = (_name(solid) for solid in self.solids if _emissivity(self, solid) is None)
        allowed = list(dict.fromkeys(name for name in names if name != _SKIN))
        for name in self.emissivities:
            if name not in allowed:
                what = (
                    f"{name!r} is no part with an emissivity to be given here; allowed: {', '.join(allowed) or 'none'}"
                )
                raise PydanticCustomError(
                    "part", "{what}", {"what": what + suggestion(name, allowed), "at": ("emissivities", name)}
                )
        return self

    def __hash__(self) -> int:
        return hash((type(self), self.length_m, self.temperature_k))  # of each in each frame; few bodies share these

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) and vars(self) == vars(other))  # a fifth of pydantic's time

    def joints(self, time: float) -> Mapping[str, Rigid]:
        """Where the joints of moving parts are at a time, s, lengths in those of the body."""
        return {}

    def draw(self, view: View) -> Sprite | None:
        return posed_sprite(self.posed(view))

    def posed(self, view: View) -> Posed:
        """What is drawn of it."""
        rest = _rest(self, view.context.band, view.context.surroundings)
        motions = self.joints(view.time) if rest.joints.names else {}
        return Posed(rest, motions, self.length_m, view, self.brightness(view))


_SKIN = "temperature"


def _name(solid: Solid) -> str:
    return solid.heat.removesuffix("_k")


def _emissivity(body: Body, solid: Solid) -> float | None:
    """By the part's own key; None where the body has none."""
    found: float | None = getattr(body, f"{_name(solid)}_emissivity", None)
    return found


@lru_cache(maxsize=64)
def _parts(body: type[Body]) -> tuple[Solid, ...]:
    return parted(body.solids)


@lru_cache(maxsize=64)
def _joints(body: type[Body]) -> Joints:
    parts = _parts(body)
    names = tuple(sorted({solid.joint for solid in parts if solid.joint}))
    return Joints(names, np.array([names.index(solid.joint) if solid.joint else -1 for solid in parts], np.int64))


@lru_cache(maxsize=64)
def _mesh(body: type[Body], length_m: float) -> Mesh:
    return mesh(_parts(body), length_m)


@lru_cache(maxsize=64)
def _rest(body: Body, band: Band, surroundings: float) -> Rest:
    """All of it that stays from frame to frame."""
    kind = type(body)
    return Rest(_mesh(kind, body.length_m), _joints(kind), _glow(body, band, surroundings))


def _glow(body: Body, band: Band, surroundings: float) -> Floats:
    """(parts,) in-band radiance, W/m2/sr."""
    parts = _parts(type(body))
    temperatures = np.array([getattr(body, solid.heat) for solid in parts])
    own = (_emissivity(body, solid) for solid in parts)
    others = (body.emissivities.get(_name(solid), body.emissivity) for solid in parts)
    emissivities = np.array([one if one is not None else other for one, other in zip(own, others, strict=True)])
    return grey_body(band, temperatures, emissivities, surroundings)


def draw_all(things: Sequence[tuple[Shape, View]]) -> list[Sprite | None]:
    """Each of the shapes as its own `draw` gives it; where nothing is compiled, bodies are drawn together."""
    if COMPILED:
        return [shape.draw(view) for shape, view in things]
    drawn = iter(posed_sprites([shape.posed(view) for shape, view in things if isinstance(shape, Body)]))
    return [next(drawn) if isinstance(shape, Body) else shape.draw(view) for shape, view in things]
