"""Paths in metres that set out along a compass heading, level or with a steady climb."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from irsim.config.quantities import TOP_SPEED, Degrees, NotNegative, Speed, Triple
from irsim.geometry.context import SceneContext
from irsim.motion.base import MetrePath, world_to_first
from irsim.types import Floats


class HeadedPath(MetrePath):
    """A path whose kind says how far it has gone ahead along its first heading, to the right of that, and upwards."""

    start_m: Triple
    """Where it is at frame 0, m."""
    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 200.0
    """Over ground, metres a second."""
    heading_deg: Degrees = 90.0
    """Direction at frame 0, degrees: 0 level away along the first pointing (north), 90 to the right (east)."""
    climb_m_s: Speed = 0.0
    """Upwards, metres a second."""

    def climbed(self, frames: Floats, context: SceneContext) -> Floats:
        """(n,) m by which a steady climb has lifted it since frame 0."""
        return np.asarray(self.climb_m_s * np.asarray(frames) / context.rate_hz)

    def laid(self, ahead: Floats, right: Floats, up: Floats, context: SceneContext) -> Floats:
        """(n, 3) m, first camera frame: where ways of those lengths (n,), m, lead from its start."""
        return self.to_first(np.array(self.start_m), context) + level(ahead, right, up, self.heading_deg, context)


def level(ahead: Floats, right: Floats, up: Floats, heading_deg: float, context: SceneContext) -> Floats:
    """(n, 3) first-camera vectors of ways along a compass heading, to its right and upwards, each (n,)."""
    heading = math.radians(heading_deg)
    east = ahead * math.sin(heading) + right * math.cos(heading)
    north = ahead * math.cos(heading) - right * math.sin(heading)
    return world_to_first(np.stack([east, north, up], axis=-1), context)


def frames_of(seconds: float, context: SceneContext) -> float:
    """Frames of a duration, no less than one: random draws and turn rates hold for a frame at least."""
    return max(seconds * context.rate_hz, 1.0)
