"""A level flight that noses over into a dive."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.quantities import TOP_SPEED, Degrees, NotNegative, Pair, PixelSpeed, Positive, Triple
from irsim.geometry.context import SceneContext
from irsim.motion.arcs import arcs
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import MetrePath, PixelPath
from irsim.motion.headed import level
from irsim.motion.straight import unit
from irsim.types import Floats

Steepness = Annotated[float, Field(gt=0, le=90)]


def _check(at_frame: float, pull_out_frame: float | None) -> None:
    """The rule that the two kinds share; PydanticCustomError at `pull_out_frame`."""
    if pull_out_frame is not None and pull_out_frame <= at_frame:
        raise PydanticCustomError(
            "dive",
            "it pulls out before it dives; allowed: a frame after at_frame {first}",
            {"first": at_frame, "at": ("pull_out_frame",)},
        )


def _flown(
    frames: Floats, speed: float, at_frame: float, angle_deg: float, rate: float, pull_out_frame: float | None
) -> Floats:
    """(n, 2) way ahead and down since frame 0, at frame numbers (n,).

    speed: length per frame;  rate: rad per frame while it noses over and pulls out
    """
    took = math.radians(angle_deg) / rate
    over = at_frame + took
    legs = [(at_frame, over, rate)]
    if pull_out_frame is not None:
        out = max(pull_out_frame, over)
        legs.append((out, out + took, -rate))
    return arcs(frames, legs, speed)


class Dive(MetrePath):
    """Level at constant speed, then over an arc into a straight dive, and out of it again if wanted."""

    start_m: Triple
    """Where it is at frame 0, m."""
    speed_m_s: Annotated[Positive, TOP_SPEED] = 200.0
    """Along its way, metres a second."""
    heading_deg: Degrees = 90.0
    """Degrees: 0 level away along the first pointing (north), 90 to the right (east)."""
    at_frame: NotNegative = 30.0
    """Frame at which it noses over."""
    angle_deg: Steepness = 30.0
    """How steep the dive is, degrees below level."""
    pull_g: Positive = 3.0
    """Acceleration across its way while it noses over and pulls out, in g: the arcs' radius is v^2 / (pull g)."""
    pull_out_frame: NotNegative | None = None
    """Frame at which it begins to pull out, to level; not at all where not given."""

    @model_validator(mode="after")
    def _in_order(self) -> Dive:
        _check(self.at_frame, self.pull_out_frame)
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        rate = self.pull_g * STANDARD_GRAVITY / self.speed_m_s / context.rate_hz
        speed = self.speed_m_s / context.rate_hz
        ahead, down = _flown(frames, speed, self.at_frame, self.angle_deg, rate, self.pull_out_frame).T
        start = self.to_first(np.array(self.start_m), context)
        return np.asarray(start + level(ahead, np.zeros_like(ahead), -down, self.heading_deg, context))


class DivePx(PixelPath):
    """A dive as it is seen from the side: straight across the picture, then over an arc down it, and out of it again
    if wanted; at a range that stays or closes."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """Along its way, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction before the dive, degrees: 0 right, 180 left; what goes right noses over clockwise, what goes left the
    other way."""
    at_frame: NotNegative = 30.0
    """Frame at which it noses over."""
    angle_deg: Steepness = 30.0
    """By how much it noses over towards the bottom of the picture, degrees."""
    turn_deg: Annotated[float, Field(gt=0, le=90)] = 3.0
    """How fast it turns while it noses over and pulls out, degrees per frame."""
    pull_out_frame: NotNegative | None = None
    """Frame at which it begins to pull out, to its first direction; not at all where not given."""

    @model_validator(mode="after")
    def _in_order(self) -> DivePx:
        _check(self.at_frame, self.pull_out_frame)
        return self

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        rate = math.radians(self.turn_deg)
        way = _flown(frames, self.speed, self.at_frame, self.angle_deg, rate, self.pull_out_frame)
        clockwise = 90 if math.cos(math.radians(self.heading_deg)) >= 0 else -90
        axes = np.stack([unit(self.heading_deg), unit(self.heading_deg + clockwise)])
        return np.asarray(np.asarray(self.start) + way @ axes)
