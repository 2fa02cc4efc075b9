"""A body as it lies, drawn: from the outlines of its parts to its sprite."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from irsim._native import COMPILED, kernels
from irsim.geometry.silhouette import FINENESS, Outline, drawn_part, spread_table, sprites
from irsim.geometry.sprite import Sprite
from irsim.physics.psf import PSF
from irsim.targets.base import View
from irsim.targets.joints import Rigid
from irsim.targets.mesh import Mesh
from irsim.targets.part_outlines import Joints, rims
from irsim.types import Box, Floats


@dataclass(frozen=True, eq=False)
class Rest:
    """A body at rest: its form, its joints, and the light of each part (n,), W/m2/sr."""

    form: Mesh
    joints: Joints
    glow: Floats

    @cached_property
    def table(self) -> kernels.Form:
        """It as compiled loops take it."""
        form, parts = self.form, self.form.parts
        tables = parts.firsts, parts.corner, parts.edges, parts.heat
        lines = form.vertices, form.normals, form.offsets, form.crossing
        return kernels.form(*tables, *lines, form.thin, self.joints.of_part)


class Posed(NamedTuple):
    """A body, how its joints are moved, in units of `scale`, how it is seen, and how many times brighter it all is."""

    rest: Rest
    motions: Mapping[str, Rigid]
    scale: float
    view: View
    brightness: float


def posed_sprite(body: Posed) -> Sprite | None:
    """Draw a body; None where any of it lies behind the camera."""
    return _compiled_sprite(body) if COMPILED else posed_sprites([body])[0]


def posed_sprites(bodies: Sequence[Posed]) -> list[Sprite | None]:
    """Draw bodies, each as alone, but together: quicker where nothing is compiled."""
    outlines = [outlined(body) for body in bodies]
    drawn = iter(sprites([outline for outline in outlines if outline is not None]))
    return [None if outline is None else next(drawn) for outline in outlines]


def outlined(body: Posed) -> Outline | None:
    """The outlines of its parts; None where any of it lies behind the camera."""
    rest, motions, scale, view, brightness = body
    found = rims(rest.form, rest.joints, motions, scale, view, rest.glow * brightness)
    if found is None:
        return None
    window, range_m = drawn_part(found.box, view.context), math.hypot(*view.position.tolist())
    return Outline(found.edges, found.glow, found.box, window, view.context.psf, range_m, found.middle)


def _compiled_sprite(body: Posed) -> Sprite | None:
    rest, motions, scale, view, brightness = body
    context = view.context
    geometry = context.geometry
    (columns, rows), (right, down) = geometry.size, geometry.shift_px
    found = kernels.body_light(
        rest.table,
        tuple([motions[name].numbers for name in rest.joints.names]),
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
        _spreads(context.psf),
    )
    if found is None:
        return None
    x0, y0, shape, light, center, signal_center, box, range_m, area = found
    planes = np.ndarray(shape, np.float64, light)  # taken one by one, in half the time of unpacking
    return Sprite(x0, y0, planes[0], planes[1], planes[2], center, signal_center, Box(*box), range_m, area)


@lru_cache(maxsize=32)
def _spreads(psf: PSF) -> tuple[tuple[float, kernels.Spread], ...]:
    """A spread at each fineness, and the largest side, px, that it is for."""
    return tuple((limit, spread_table(psf, fine)) for limit, fine in FINENESS)
