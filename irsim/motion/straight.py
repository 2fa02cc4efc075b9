"""Paths at constant velocity."""

from __future__ import annotations

import numpy as np

from irsim.config.quantities import Degrees, Pair, PixelSpeed, Triple, Velocity
from irsim.geometry.context import SceneContext
from irsim.motion.base import MetrePath, PixelPath
from irsim.motion.dynamics import Dynamics, constant_velocity
from irsim.types import Floats


def unit(heading_deg: float) -> Floats:
    """(2,) the direction of a heading in the picture: 0 right, 90 down."""
    heading = np.radians(heading_deg)
    return np.array([np.cos(heading), np.sin(heading)])


class Straight(PixelPath):
    """A straight line in the picture."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 0.0
    """Px per frame."""
    heading_deg: Degrees = 0.0
    """Direction in the picture, degrees: 0 right, 90 down."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        return np.asarray(self.start) + self.speed * np.asarray(frames)[:, None] * unit(self.heading_deg)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return constant_velocity(("x", "y"))


class StraightM(MetrePath):
    """A straight line in space."""

    start_m: Triple
    """Where it is at frame 0, m."""
    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """Metres a second."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        seconds = np.asarray(frames)[:, None] / context.rate_hz
        start, velocity = (self.to_first(np.array(vector), context) for vector in (self.start_m, self.velocity_m_s))
        return np.asarray(start + seconds * velocity)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return constant_velocity(self.axis_names, 1 / context.rate_hz)
