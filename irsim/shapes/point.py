"""A target too small or too far to have a shape."""

from __future__ import annotations

import numpy as np

from irsim.kinds import Fraction, Kelvin, Positive
from irsim.optics import fwhm_px, reach_px, shares
from irsim.shapes.base import Shape, View
from irsim.sprite import Sprite
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
        emission = alpha * stage.glow(self.temperature_k, self.emissivity)
        width = fwhm_px(stage.psf_px)
        return Sprite(x0, y0, cover, alpha, emission, (x, y), (x, y), Box(x, y, width, width), range_m)
