"""A target too small or too far to have a shape."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import ClassVar

import numpy as np
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from irsim.config.quantities import Area, Fraction, Kelvin, KelvinDifference, Number
from irsim.geometry.context import SceneContext
from irsim.geometry.sprite import Sprite, Wanted
from irsim.physics.diffraction import with_wings
from irsim.physics.radiometry import slope
from irsim.targets.base import Shape, View
from irsim.targets.ellipse import ellipse
from irsim.types import Band, Box, Floats

FAINT_K = 0.01
"""Light in which a point's spread may end, as what is so much warmer at 300 K adds; brighter points have far wings."""

SMALL_PX = 1.0
"""Diameter from which on it is drawn as a disc."""


class Point(Shape):
    """A point target: the optics spread its light, and its area says how much of a pixel it fills.

    It replaces the share phi of one pixel's light that its solid angle has of the pixel's, spread over pixels by the
    blur. Nearer, where it is more than a pixel wide, it is a disc of that area, and the blur is that of
    its edges; until then the blur is wider by the disc's variance, so that neither light nor width jump.
    """

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = dict.fromkeys(
        ("contrast_k", "scr"), ("temperature_k", "emissivity")
    )

    area_m2: Area = 0.2
    """Projected area, m2."""
    temperature_k: Kelvin = 350.0
    """Kelvin."""
    emissivity: Fraction = 0.95
    contrast_k: KelvinDifference | None = None
    """Apparent temperature of the point itself less that of what is behind it, K, in place of its temperature; its
    light is worked out with nothing switched off."""
    scr: Number | None = None
    """Signal-to-clutter ratio against what is behind it and the camera's noise there, in place of its temperature;
    negative where it is darker (never darker than without light: a cold one needs an area); its light is worked out
    with nothing switched off."""

    @model_validator(mode="after")
    def _one_brightness(self) -> Point:
        if self.contrast_k is not None and self.scr is not None:
            raise PydanticCustomError(
                "two_brightnesses", "contrast_k and scr stand together; allowed: one of them", {"at": ("scr",)}
            )
        return self

    def draw(self, view: View) -> Sprite | None:
        context = view.context
        middle = context.geometry.project(view.position)
        if not np.isfinite(middle).all():
            return None
        range_m = float(np.linalg.norm(view.position))
        phi = self.area_m2 * context.geometry.scale(view.position) ** 2
        gain = self.brightness(view)
        glow = float(context.glow(self.temperature_k, self.emissivity)) * gain
        wanted = None
        if self.contrast_k is not None or self.scr is not None:
            wanted = Wanted(self.contrast_k, self.scr, gain)
        width = 2 * math.sqrt(phi / math.pi)
        if width <= SMALL_PX:
            return _point(middle, phi, glow, range_m, wanted, context)
        disc = ellipse(middle, np.full(2, width / 2), glow, range_m, context)
        if disc is None:
            return None
        side = max(width, context.psf.fwhm_px)
        return disc._replace(box=Box(*disc.center, side, side), wanted=wanted)


def _point(
    middle: Floats, phi: float, glow: float, range_m: float, wanted: Wanted | None, context: SceneContext
) -> Sprite:
    """What fills `phi` of a pixel's area, its light spread as that of a Gaussian with a disc's variance."""
    x, y = middle.tolist()
    spread = context.psf.broadened(math.sqrt(phi / math.pi) / 2)
    if phi * glow > 0:
        spread = with_wings(spread, _faint(context.band) / (phi * glow))
    reach = spread.support_px
    x0, y0 = round(x) - reach, round(y) - reach
    pixels = np.arange(2 * reach + 1)
    cover = spread.pixel_integral(y0 + pixels - y, x0 + pixels - x)
    alpha, width = phi * cover, context.psf.fwhm_px
    return Sprite(x0, y0, cover, alpha, glow * alpha, (x, y), (x, y), Box(x, y, width, width), range_m, 1.0, wanted)


@lru_cache
def _faint(band: Band) -> float:
    """FAINT_K as radiance, W/m2/sr."""
    return FAINT_K * slope(band, 300.0)
