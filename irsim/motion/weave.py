"""A path that weaves about a straight line."""

from __future__ import annotations

import numpy as np

from irsim.kinds import Degrees, NotNegative, Pair, PixelSpeed, Positive
from irsim.motion.base import PixelPath
from irsim.motion.straight import unit
from irsim.stage import Stage
from irsim.types import Floats


class Weave(PixelPath):
    """A sinusoid about a straight line in the picture; `amplitude_px: 0` is the line itself."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 0.0
    """Along the line, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction of the line, degrees: 0 right, 90 down."""
    amplitude_px: NotNegative = 10.0
    """Largest distance from the line, px."""
    period_frames: Positive = 60.0
    """Length of one weave, frames."""
    phase_deg: Degrees = 0.0
    """Phase at frame 0: the line is laid so that the path starts at `start` whatever the phase."""

    def pixels(self, frames: Floats, stage: Stage, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)[:, None]
        along, across = unit(self.heading_deg), unit(self.heading_deg + 90)
        phase = np.radians(self.phase_deg)
        swing = np.sin(2 * np.pi * frames / self.period_frames + phase) - np.sin(phase)
        return np.asarray(self.start + self.speed * frames * along + self.amplitude_px * swing * across)
