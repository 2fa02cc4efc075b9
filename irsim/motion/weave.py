"""Paths that weave about a straight line."""

from __future__ import annotations

import math

import numpy as np

from irsim.config.quantities import Degrees, NotNegative, Pair, PixelSpeed, Positive
from irsim.geometry.context import SceneContext
from irsim.motion.base import PixelPath
from irsim.motion.headed import HeadedPath
from irsim.motion.straight import unit
from irsim.types import Floats


def swing(times: Floats, period: float, phase_deg: float) -> Floats:
    """A sine of height 1 at times of any shape, in the unit of its period, from 0 at time 0 on."""
    phase = np.radians(phase_deg)
    return np.asarray(np.sin(2 * np.pi * times / period + phase) - np.sin(phase))


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

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)[:, None]
        along, across = unit(self.heading_deg), unit(self.heading_deg + 90)
        aside = self.amplitude_px * swing(frames, self.period_frames, self.phase_deg)
        return np.asarray(self.start + self.speed * frames * along + aside * across)


class WeaveM(HeadedPath):
    """A sinusoid about a straight line in space; `amplitude_m: 0` is the line itself.

    Farthest from the line it pulls amplitude_m (2 pi / period_s)^2 m/s2: 20 m in 5 s are 3.2 g.
    """

    amplitude_m: NotNegative = 20.0
    """Largest distance from the line, m."""
    period_s: Positive = 5.0
    """Length of one weave, s."""
    phase_deg: Degrees = 0.0
    """Phase at frame 0: the line is laid so that the path starts at `start_m` whatever the phase."""
    tilt_deg: Degrees = 0.0
    """Plane of the weave, turned about the line, degrees: 0 it swings level, first to the right; 90 up and down, first
    up."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        seconds = np.asarray(frames, dtype=np.float64) / context.rate_hz
        aside = self.amplitude_m * swing(seconds, self.period_s, self.phase_deg)
        tilt, slope = math.radians(self.tilt_deg), math.atan2(self.climb_m_s, self.speed_m_s)
        ahead = self.speed_m_s * seconds - aside * math.sin(tilt) * math.sin(slope)
        up = self.climb_m_s * seconds + aside * math.sin(tilt) * math.cos(slope)
        return self.laid(ahead, aside * math.cos(tilt), up, context)
