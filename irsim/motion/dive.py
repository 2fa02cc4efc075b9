"""Dives: level flight, an arc into a straight dive, and a pull-out; in pixels and in metres."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import TOP_SPEED, Degrees, NotNegative, PixelSpeed, Positive, Triple
from irsim.geometry.context import SceneContext
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import HeadedPixelPath, MetrePath, offsets_along_heading, path_error, unit
from irsim.motion.curves import arcs
from irsim.motion.scripted import Steepness
from irsim.types import Floats


def _check_dive(at_frame: float, pull_out_frame: float | None) -> None:
    """Raise PydanticCustomError at `pull_out_frame` unless the pull-out follows the dive."""
    if pull_out_frame is not None and pull_out_frame <= at_frame:
        message = "the pull-out comes before the dive; allowed: a frame after at_frame {first}"
        raise path_error(message, "pull_out_frame", first=at_frame)


def _dive(
    frames: Floats, speed: float, at_frame: float, angle_deg: float, rate: float, pull_out_frame: float | None
) -> Floats:
    """Return the displacement ahead and down since frame 0, (n, 2), at frame numbers (n,).

    speed: distance per frame; rate: pitch rate, rad per frame
    """
    duration = math.radians(angle_deg) / rate
    end = at_frame + duration
    legs = [(at_frame, end, rate)]
    if pull_out_frame is not None:
        out = max(pull_out_frame, end)
        legs.append((out, out + duration, -rate))
    return arcs(frames, legs, speed)


class Dive(MetrePath):
    """Level flight, then an arc into a straight dive, and optionally a pull-out, at constant speed."""

    start_m: Triple
    """Position at frame 0, m."""
    speed_m_s: Annotated[Positive, TOP_SPEED] = 200.0
    """Speed along the path, m/s."""
    heading_deg: Degrees = 90.0
    """Direction, degrees: 0 level away along the first pointing (north), 90 to the right (east)."""
    at_frame: NotNegative = 30.0
    """Frame at which the dive begins."""
    angle_deg: Steepness = 30.0
    """Dive angle, degrees below level."""
    pull_g: Positive = 3.0
    """Acceleration across the path on the arcs, in g; the radius of the arcs is v^2 / (`pull_g` g)."""
    pull_out_frame: NotNegative | None = None
    """Frame at which the pull-out to level begins. Default: no pull-out."""

    @model_validator(mode="after")
    def _in_order(self) -> Dive:
        _check_dive(self.at_frame, self.pull_out_frame)
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        rate = self.pull_g * STANDARD_GRAVITY / self.speed_m_s / context.rate_hz
        speed = self.speed_m_s / context.rate_hz
        ahead, down = _dive(frames, speed, self.at_frame, self.angle_deg, rate, self.pull_out_frame).T
        start = self.to_first(np.array(self.start_m), context)
        return np.asarray(start + offsets_along_heading(ahead, np.zeros_like(ahead), -down, self.heading_deg, context))


class DivePx(HeadedPixelPath):
    """Dive seen from the side: straight across the picture, an arc down, and optionally a pull-out."""

    speed: PixelSpeed = 2.0
    """Speed along the path, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction before the dive, degrees: 0 right, 180 left; the dive turns clockwise to the right, anticlockwise to
    the left."""
    at_frame: NotNegative = 30.0
    """Frame at which the dive begins."""
    angle_deg: Steepness = 30.0
    """Dive angle towards the bottom of the picture, degrees."""
    turn_deg: Annotated[float, Field(gt=0, le=90)] = 3.0
    """Turn rate on the arcs, degrees per frame."""
    pull_out_frame: NotNegative | None = None
    """Frame at which the target begins to turn back to its direction before the dive. Default: it does not."""

    @model_validator(mode="after")
    def _in_order(self) -> DivePx:
        _check_dive(self.at_frame, self.pull_out_frame)
        return self

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        rate = math.radians(self.turn_deg)
        way = _dive(frames, self.speed, self.at_frame, self.angle_deg, rate, self.pull_out_frame)
        clockwise = 90 if math.cos(math.radians(self.heading_deg)) >= 0 else -90
        axes = np.stack([unit(self.heading_deg), unit(self.heading_deg + clockwise)])
        return np.asarray(np.asarray(self.start) + way @ axes)
