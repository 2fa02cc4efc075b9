"""A target too small or too far to have a shape."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from irsim.kinds import Fraction, Kelvin, KelvinDifference, Number, Positive
from irsim.optics import fwhm_px, reach_px, shares
from irsim.shapes.base import Shape, View
from irsim.sprite import Sprite, Wanted
from irsim.types import Box


class Point(Shape):
    """A point target: the optics spread its light, and its area says how much of a pixel it fills.

    It replaces the share phi = area / (range ifov)^2 of one pixel's light, spread over pixels by the
    blur; where that is more than all of a pixel's light, all (it is then no point any more).
    """

    area_m2: Positive = 0.2
    """Projected area, m2."""
    temperature_k: Kelvin = 350.0
    """Kelvin."""
    emissivity: Fraction = 0.95
    contrast_k: KelvinDifference | None = None
    """Apparent temperature of the point itself less that of what is behind it, K, in place of its temperature."""
    scr: Number | None = None
    """Signal-to-clutter ratio against what is behind it and the camera's NETD, in place of its temperature;
    negative where it is darker (never darker than without light: a cold one needs an area)."""

    @model_validator(mode="after")
    def _one_brightness(self) -> Point:
        if self.contrast_k is not None and self.scr is not None:
            raise PydanticCustomError(
                "two_brightnesses", "contrast_k and scr stand together; allowed: one of them", {"at": ("scr",)}
            )
        return self

    def draw(self, view: View) -> Sprite | None:
        stage = view.stage
        x, y = view.stage.geometry.project(view.position).tolist()
        if not np.isfinite(x):
            return None
        range_m = float(np.linalg.norm(view.position))
        phi = self.area_m2 / (range_m * stage.geometry.ifov_rad) ** 2
        reach = reach_px(stage.psf_px)
        x0, y0 = round(x) - reach, round(y) - reach
        pixels = np.arange(2 * reach + 1)
        cover = np.outer(shares(y0 + pixels - y, stage.psf_px), shares(x0 + pixels - x, stage.psf_px))
        alpha = np.minimum(phi * cover, 1.0)
        gain = self.brightness(view)
        emission = alpha * stage.glow(self.temperature_k, self.emissivity) * gain
        wanted = None
        if self.contrast_k is not None or self.scr is not None:
            wanted = Wanted(self.contrast_k, self.scr, stage.noise_k, gain)
        width = fwhm_px(stage.psf_px)
        return Sprite(x0, y0, cover, alpha, emission, (x, y), (x, y), Box(x, y, width, width), range_m, 1.0, wanted)
