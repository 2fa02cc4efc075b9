"""Coordinated turns at given rates over given frames."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import model_validator

from irsim.kinds import TOP_SPEED, Degrees, NotNegative, Number, Pair, PixelSpeed, Triple
from irsim.motion.arcs import Legs, arcs, check_legs
from irsim.motion.base import MetrePath, PixelPath, world_to_first
from irsim.motion.straight import unit
from irsim.stage import Stage
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

    def pixels(self, frames: Floats, stage: Stage, name: str) -> Floats:
        legs = [(first, last, math.radians(rate)) for first, last, rate in self.turns]
        way = arcs(frames, legs, self.speed)
        axes = np.stack([unit(self.heading_deg), unit(self.heading_deg + 90)])
        return np.asarray(np.asarray(self.start) + way @ axes)


class TurnsM(MetrePath):
    """Level flight at constant speed in space, turning at given rates over given frames and straight between."""

    start_m: Triple
    """Where it is at frame 0, m."""
    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 200.0
    """Over ground, metres a second."""
    heading_deg: Degrees = 90.0
    """Direction at frame 0, degrees: 0 level away along the first pointing (north), 90 to the right (east)."""
    climb_m_s: Number = 0.0
    """Upwards, metres a second."""
    turns: Legs = ()
    """List of [from frame, to frame, degrees a second]; positive turns right."""

    @model_validator(mode="after")
    def _in_order(self) -> TurnsM:
        check_legs(self.turns)
        return self

    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        legs = [(first, last, math.radians(rate) / stage.rate_hz) for first, last, rate in self.turns]
        ahead, right = arcs(frames, legs, self.speed_m_s / stage.rate_hz).T
        up = self.climb_m_s * np.asarray(frames) / stage.rate_hz
        return self.to_first(np.array(self.start_m), stage) + level(ahead, right, up, self.heading_deg, stage)


def level(ahead: Floats, right: Floats, up: Floats, heading_deg: float, stage: Stage) -> Floats:
    """(n, 3) first-camera vectors of ways along a compass heading, to its right and upwards, each (n,)."""
    heading = math.radians(heading_deg)
    east = ahead * math.sin(heading) + right * math.cos(heading)
    north = ahead * math.cos(heading) - right * math.sin(heading)
    return world_to_first(np.stack([east, north, up], axis=-1), stage)
