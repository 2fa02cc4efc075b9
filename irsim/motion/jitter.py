"""A mount that shakes."""

from __future__ import annotations

import numpy as np

from irsim.config.quantities import NotNegative, Positive
from irsim.geometry.context import SceneContext
from irsim.motion.base import Pointing
from irsim.motion.shaking import shaking
from irsim.rng import stream
from irsim.types import Floats

_WAVES = 32
"""Sinusoids per axis: their sum is within a few percent of Gaussian."""


class Jitter(Pointing):
    """Stationary random shaking in azimuth and elevation, independent of each other.

    A sum of sinusoids with random phases and normally distributed frequencies: its mean autocorrelation is
    rms^2 exp(-t^2 / (2 correlation_s^2)), and it is smooth.
    """

    rms_px: NotNegative = 0.5
    """Root mean square of each axis, px at zoom 1: an angle, which a zoom shows larger."""
    correlation_s: Positive = 0.1
    """Correlation time, s."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        rng = stream(context.seed, self.name, "jitter")
        angular = rng.standard_normal((2, _WAVES)) / self.correlation_s
        phases = rng.uniform(0, 2 * np.pi, (2, _WAVES))
        return shaking(self.rms_px, angular, phases, frames, context)
