"""A detector's noise as the light that would do the same."""

from __future__ import annotations

import math
from dataclasses import dataclass

from irsim.camera.response import Response
from irsim.camera.variance import Variance
from irsim.types import Box, Floats

LEAST = 1e-3
"""Share of light below which a pixel is taken for one of this share: without any, no light would be enough."""


@dataclass(frozen=True, eq=False)
class Equivalent:
    """Noise-equivalent radiance: the light that raises the signal by what pixels of one frame differ by. falloff
    (rows, cols) is the share of light that the lens lets through."""

    response: Response
    variance: Variance
    falloff: Floats | None = None

    def __call__(self, level: float, box: Box) -> float:
        """Standard deviation, W/m2/sr, at a level of light, W/m2/sr, about the middle of a box."""
        passed = 1.0 if self.falloff is None else _nearest(self.falloff, box)
        light = max(level * passed, 0.0)  # below by rounding alone
        sigma = math.sqrt(self.variance.within(self.response.at(light), self.response))
        return self.response.raised(light, sigma) / passed


def _nearest(falloff: Floats, box: Box) -> float:
    rows, columns = falloff.shape
    row, column = (min(max(round(at), 0), count - 1) for at, count in ((box.cy, rows), (box.cx, columns)))
    return max(float(falloff[row, column]), LEAST)
