"""A warm patch: a fire, a sun-heated rock, a vent."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction, Kelvin, Positive
from irsim.geometry.sprite import Sprite
from irsim.targets.base import Shape, View
from irsim.targets.ellipse import ellipse


class HotSpot(Shape):
    """A patch that looks the same from everywhere: an ellipse across the line of sight, whatever its attitude."""

    size_m: Annotated[tuple[Positive, Positive], Field(strict=False)] = (2.0, 1.2)
    """[width, height], m."""
    temperature_k: Kelvin = 330.0
    """Kelvin."""
    emissivity: Fraction = 0.95

    @property
    def stands_for(self) -> str:
        return "decoy"

    def draw(self, view: View) -> Sprite | None:
        context = view.context
        middle = context.geometry.project(view.position)
        if not np.isfinite(middle).all():
            return None
        range_m = float(np.linalg.norm(view.position))
        halves = np.array(self.size_m) / 2 * context.geometry.scale(view.position)
        glow = float(context.glow(self.temperature_k, self.emissivity)) * self.brightness(view)
        return ellipse(middle, halves, glow, range_m, context)
