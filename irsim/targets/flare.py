"""A burning flare: a decoy that draws a seeker away."""

from __future__ import annotations

import math

from irsim.config.quantities import Area, Kelvin, NotNegative, Positive
from irsim.geometry.sprite import Sprite
from irsim.targets.base import View
from irsim.targets.point import Point

_OUT = 1e-3
"""Share of its full fire below which a flare is burnt out."""


class Flare(Point):
    """A flare that lights up when it is thrown (`path: {kind: thrown, ...}`), burns, and goes out; a point target
    whose fire grows and shrinks. On a path without a beginning it burns steadily."""

    area_m2: Area = 0.3
    """Projected area of its full fire, m2."""
    temperature_k: Kelvin = 2000.0
    """Of the fire, kelvin (magnesium and teflon: about 2000)."""
    rise_s: NotNegative = 0.15
    """Time in which it lights up, to 63 %, s. Above 0, it is dark in the frame of its throw, and in truth from the next
    on."""
    burn_s: NotNegative = 2.5
    """How long it burns before it begins to fade, s."""
    fade_s: Positive = 0.6
    """Time in which it fades, to 37 %, s."""

    @property
    def stands_for(self) -> str:
        return "decoy"

    def fire(self, age_s: float) -> float:
        """Share 0..1 of its full fire at a time after it was thrown, s."""
        if age_s == math.inf:
            return 1.0
        risen = 1 - math.exp(-age_s / self.rise_s) if self.rise_s > 0 else float(age_s >= 0)
        return risen * math.exp(-max(age_s - self.burn_s, 0.0) / self.fade_s)

    def draw(self, view: View) -> Sprite | None:
        fire = self.fire(view.age)
        if fire < _OUT:
            return None
        return Point.draw(self.model_copy(update={"area_m2": self.area_m2 * fire}), view)
