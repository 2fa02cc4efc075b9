"""A camera that is carried along."""

from __future__ import annotations

import numpy as np

from irsim.kinds import Positive, Triple
from irsim.motion.base import Pointing, world_to_first
from irsim.stage import Stage
from irsim.types import Floats


class Platform(Pointing):
    """A camera carried evenly along from frame 0 on: near things pass by, what is infinitely far stays."""

    velocity_m_s: Triple = (0.0, 0.0, 0.0)
    """[east, north, up], metres a second; north is level ahead at the first pointing."""
    sway_m: Triple = (0.0, 0.0, 0.0)
    """Largest distance from the even way, [east, north, up], m: a ship that rolls, a drone in gusts."""
    sway_period_s: Positive = 5.0
    """Time of one sway, s."""

    def shifts(self, frames: Floats, stage: Stage) -> Floats:
        seconds = np.asarray(frames, dtype=np.float64)[:, None] / stage.rate_hz
        sway = np.sin(2 * np.pi * seconds / self.sway_period_s) * np.array(self.sway_m)
        return world_to_first(seconds * np.array(self.velocity_m_s) + sway, stage)
