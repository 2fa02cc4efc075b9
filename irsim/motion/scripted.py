"""Scripted paths: straight, turning, weaving, through waypoints, diving; in pixels and in metres."""

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
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import (
    Dynamics,
    HeadedPath,
    HeadedPixelPath,
    MetrePath,
    PixelPath,
    constant_velocity,
    offsets_along_heading,
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
