"""Scripted paths: straight, turning, weaving, through waypoints; in pixels and in metres."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from irsim.config.base import Several
from irsim.config.quantities import (
    TOP_PIXEL_SPEED,
    TOP_SPEED,
    Degrees,
    NotNegative,
    Number,
    Pair,
    PixelSpeed,
    Positive,
    Triple,
    Velocity,
)
from irsim.geometry.context import SceneContext
from irsim.motion.base import (
    Dynamics,
    HeadedPath,
    HeadedPixelPath,
    MetrePath,
    PixelPath,
    constant_velocity,
    path_error,
    unit,
)
from irsim.motion.curves import Legs, Spline, arcs, check_legs
from irsim.types import Floats


class Straight(HeadedPixelPath):
    """Straight line in the picture at constant speed."""

    speed: PixelSpeed = 0.0
    """Speed, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction in the picture, degrees: 0 right, 90 down."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        return np.asarray(self.start) + self.speed * np.asarray(frames)[:, None] * unit(self.heading_deg)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return constant_velocity(("x", "y"))


class StraightM(MetrePath):
    """Straight line in space at constant velocity."""

    start_m: Triple
    """Position at frame 0, m."""
    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """Velocity, m/s."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        seconds = np.asarray(frames)[:, None] / context.rate_hz
        start, velocity = (self.to_first(np.array(vector), context) for vector in (self.start_m, self.velocity_m_s))
        return np.asarray(start + seconds * velocity)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return constant_velocity(self.axis_names, 1 / context.rate_hz)


class Turns(HeadedPixelPath):
    """Motion at constant speed in the picture: turns at given rates between given frames, straight lines elsewhere."""

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
    """Level flight at constant speed: turns at given rates between given frames, straight lines elsewhere."""

    turns: Legs = ()
    """List of [from frame, to frame, degrees a second]; positive turns right."""

    @model_validator(mode="after")
    def _in_order(self) -> TurnsM:
        check_legs(self.turns)
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        legs = [(first, last, math.radians(rate) / context.rate_hz) for first, last, rate in self.turns]
        ahead, right = arcs(frames, legs, self.speed_m_s / context.rate_hz).T
        return self.displaced(ahead, right, self.climb(frames, context), context)


def swing(times: Floats, period: float, phase_deg: float) -> Floats:
    """Return a sine of amplitude 1 minus its value at time 0; times and period are in one unit."""
    phase = np.radians(phase_deg)
    return np.asarray(np.sin(2 * np.pi * times / period + phase) - np.sin(phase))


class Weave(HeadedPixelPath):
    """A sinusoid about a straight line in the picture; `amplitude_px: 0` is the line itself."""

    speed: PixelSpeed = 0.0
    """Speed along the line, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction of the line, degrees: 0 right, 90 down."""
    amplitude_px: NotNegative = 10.0
    """Amplitude, px."""
    period_frames: Positive = 60.0
    """Period, frames."""
    phase_deg: Degrees = 0.0
    """Phase at frame 0, degrees; the path starts at `start` for any phase."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)[:, None]
        along, across = unit(self.heading_deg), unit(self.heading_deg + 90)
        aside = self.amplitude_px * swing(frames, self.period_frames, self.phase_deg)
        return np.asarray(self.start + self.speed * frames * along + aside * across)


class WeaveM(HeadedPath):
    """A sinusoid about a straight line in space; `amplitude_m: 0` is the line itself.

    Its largest acceleration is amplitude_m (2 pi / period_s)^2: 20 m in 5 s are 3.2 g.
    """

    amplitude_m: NotNegative = 20.0
    """Amplitude, m."""
    period_s: Positive = 5.0
    """Period, s."""
    phase_deg: Degrees = 0.0
    """Phase at frame 0, degrees; the path starts at `start_m` for any phase."""
    tilt_deg: Degrees = 0.0
    """Rotation of the plane of the weave about the line, degrees: 0 level, with the first swing to the right; 90
    vertical, with the first swing up."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        seconds = np.asarray(frames, dtype=np.float64) / context.rate_hz
        aside = self.amplitude_m * swing(seconds, self.period_s, self.phase_deg)
        tilt, slope = math.radians(self.tilt_deg), math.atan2(self.climb_m_s, self.speed_m_s)
        ahead = self.speed_m_s * seconds - aside * math.sin(tilt) * math.sin(slope)
        up = self.climb_m_s * seconds + aside * math.sin(tilt) * math.cos(slope)
        return self.displaced(ahead, aside * math.cos(tilt), up, context)


def _check_waypoints(
    points: tuple[tuple[float, ...], ...], frames: tuple[float, ...] | None, speed: float | None
) -> None:
    """Raise PydanticCustomError at the wrong key unless waypoints have frames or a speed that fit them."""
    if frames is None and speed is None:
        raise path_error("neither 'frames' nor a speed is given; allowed: one of them")
    if frames is not None and speed is not None:
        raise path_error("'frames' and a speed exclude each other; allowed: one of them", "frames")
    if frames is not None and len(frames) != len(points):
        message = "frames: {frames}, points: {points}; allowed: one frame for each point"
        raise path_error(message, "frames", frames=len(frames), points=len(points))
    if frames is not None and any(b <= a for a, b in pairwise(frames)):
        raise path_error("the frames do not rise; allowed: rising frames", "frames")
    if speed is not None and any(a == b for a, b in pairwise(points)):
        raise path_error("two consecutive points are equal; allowed with a speed: points that differ", "points")


def _along(points: tuple[tuple[float, ...], ...], at: tuple[float, ...] | None, speed: float, frames: Floats) -> Floats:
    """Return positions (n, d) at frame numbers (n,) on a spline through `points`: at frames `at`, or at `speed` per
    frame."""
    places = np.array(points)
    frames = np.asarray(frames, dtype=np.float64)
    if at is not None:
        return Spline(np.array(at), places).at(frames)
    chords = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return Spline(np.append(0.0, np.cumsum(chords)), places).at_distance(speed * frames)


class Waypoints(PixelPath):
    """Cubic spline through points of the picture, straight before the first and after the last."""

    points: Annotated[Several[Pair], Field(min_length=2)]
    """List of [x, y], px."""
    frames: Several[Number] | None = None
    """Frames at which the points are passed; alternative to `speed`."""
    speed: Annotated[Positive, TOP_PIXEL_SPEED] | None = None
    """Constant speed along the curve from the first point at frame 0, px per frame; alternative to `frames`."""

    @model_validator(mode="after")
    def _one_pace(self) -> Waypoints:
        _check_waypoints(self.points, self.frames, self.speed)
        return self

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        return _along(self.points, self.frames, self.speed or 0.0, frames)


class WaypointsM(MetrePath):
    """Cubic spline through points in space, straight before the first and after the last."""

    points: Annotated[Several[Triple], Field(min_length=2)]
    """List of positions, m."""
    frames: Several[Number] | None = None
    """Frames at which the points are passed; alternative to `speed_m_s`."""
    speed_m_s: Annotated[Positive, TOP_SPEED] | None = None
    """Constant speed along the curve from the first point at frame 0, m/s; alternative to `frames`."""

    @model_validator(mode="after")
    def _one_pace(self) -> WaypointsM:
        _check_waypoints(self.points, self.frames, self.speed_m_s)
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        places = _along(self.points, self.frames, (self.speed_m_s or 0.0) / context.rate_hz, frames)
        return self.to_first(places, context)


Steepness = Annotated[float, Field(gt=0, le=90)]
