"""Coordinated turns at given rates over given frames."""

from __future__ import annotations

import math

import numpy as np
from pydantic import model_validator

from irsim.config.quantities import Degrees, Pair, PixelSpeed
from irsim.geometry.context import SceneContext
from irsim.motion.arcs import Legs, arcs, check_legs
from irsim.motion.base import PixelPath
from irsim.motion.headed import HeadedPath
from irsim.motion.straight import unit
from irsim.types import Floats


class Turns(PixelPath):
    """Constant speed in the picture, turning at given rates over given frames and straight between."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """Px per frame."""
    heading_deg: Degrees = 0.0
    """Direction at frame 0, degrees: 0 right, 90 down."""
    turns: Legs = ()
    """List of [from frame, to frame, degrees per frame]; positive turns clockwise."""

    @model_validator(mode="after")
    def _in_order(self) -> Turns:
        check_legs(self.turns)
        return self

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        legs = [(first, last, math.radians(rate)) for first, last, rate in self.turns]
        way = arcs(frames, legs, self.speed)
        axes = np.stack([unit(self.heading_deg), unit(self.heading_deg + 90)])
        return np.asarray(np.asarray(self.start) + way @ axes)


class TurnsM(HeadedPath):
    """Level flight at constant speed in space, turning at given rates over given frames and straight between."""

    turns: Legs = ()
    """List of [from frame, to frame, degrees a second]; positive turns right."""

    @model_validator(mode="after")
    def _in_order(self) -> TurnsM:
        check_legs(self.turns)
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        legs = [(first, last, math.radians(rate) / context.rate_hz) for first, last, rate in self.turns]
        ahead, right = arcs(frames, legs, self.speed_m_s / context.rate_hz).T
        return self.laid(ahead, right, self.climbed(frames, context), context)
