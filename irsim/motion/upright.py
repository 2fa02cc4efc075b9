"""Postures with a heading over the ground: upright, hung from rotors, or with the nose up and down within bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.way import Posture, Way
from irsim.types import Floats

LEAST_LIFT = 0.25
"""Rotors pull upwards by at least this share of the weight, however fast a path falls: a choice, so that
a fall leaves a body its up and down."""
TURNING_M_S = 0.5
"""Speed from which a heading (horizontal speed) and a pitch follow it at the full rate; below, the rate goes with its
square, so that what hovers or stands keeps them."""
STANDING_M_S = 0.01
"""What is slower than this in frame 0 looks to the camera's right, level."""


@dataclass(frozen=True)
class Upright(Posture):
    """It stands upright whatever its path, and looks where it goes over the ground; what stands keeps its heading."""

    turn_deg_s: float = 180.0
    """How fast it turns at most, degrees a second: a person about in a second. A choice."""

    def bodies(self, way: Way, frames: Floats) -> Floats:
        whole, before, velocity, acceleration = _moving(way, frames)
        heading = _headings(before, math.radians(self.turn_deg_s) / way.context.rate_hz)
        return np.asarray(way.axes @ _held(self.ups(velocity, acceleration), np.interp(frames, whole, heading)))

    def ups(self, velocity: Floats, acceleration: Floats) -> Floats:
        """(n, 3) unit vectors: the body's own up, from (n, 3) m/s and (n, 3) m/s2, all as (right, ahead, up)."""
        return np.broadcast_to([0.0, 0.0, 1.0], velocity.shape)


@dataclass(frozen=True, kw_only=True)
class Rotorcraft(Upright):
    """Its rotors pull along the body's up, which therefore lies along a + g up + d v_h: what accelerates it,
    carries it and meets the drag of its horizontal speed.

    Level in hover and in a steady climb; nose down by atan(d v / g) at a steady speed, nose up where it
    brakes; a turn leans it across its heading by atan(v omega / g). Drag goes with the speed, as that of
    rotors does (Faessler, Franchi, Scaramuzza, IEEE RA-L 3(2), 2018, where attitude follows from the path
    by the same sum), and is given by the tilt at one speed: d = g tan(tilt) / speed.
    """

    speed_m_s: float
    tilt_deg: float
    """Its tilt in steady level flight at that speed, degrees."""
    steepest_deg: float
    """It tilts no more than that, degrees; paths that ask for more than that in level flight get just that, so that
    an impossible loop does not throw it about."""

    def ups(self, velocity: Floats, acceleration: Floats) -> Floats:
        drag = STANDARD_GRAVITY * math.tan(math.radians(self.tilt_deg)) / self.speed_m_s
        force = acceleration + drag * velocity * [1.0, 1.0, 0.0]
        most = STANDARD_GRAVITY * math.tan(math.radians(self.steepest_deg))
        force *= most / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), most)
        push = force[:, :2]
        lift = np.maximum(force[:, 2] + STANDARD_GRAVITY, LEAST_LIFT * STANDARD_GRAVITY)
        strength = np.linalg.norm(push, axis=1)
        tilt = np.minimum(np.arctan2(strength, lift), math.radians(self.steepest_deg))
        level = push * (np.sin(tilt) / np.maximum(strength, np.finfo(float).tiny))[:, None]
        return np.concatenate([level, np.cos(tilt)[:, None]], axis=1)


@dataclass(frozen=True, kw_only=True)
class Pitched(Upright):
    """Its heading is its course over the ground, and its nose follows the course up and down too, within bounds.

    It never goes over: where a course passes through the vertical it turns about, at its rate.
    """

    steepest_deg: float
    """Its nose is no farther up or down, degrees."""
    levels: bool = False
    """Does it lie the more level the steeper a course is beyond that? A course straight up then leaves it level."""
    bank_deg: float = 0.0
    """It leans into turns as coordinated flight does, tan(bank) = sideways acceleration over g, by no more, degrees."""

    def bodies(self, way: Way, frames: Floats) -> Floats:
        whole, before, _, acceleration = _moving(way, frames)
        yaw, pitch = (np.interp(frames, whole, angle) for angle in self._followed(before, way.context.rate_hz))
        level = np.zeros(len(frames))
        right = np.stack([np.cos(yaw), -np.sin(yaw), level], axis=-1)
        upright = np.stack([-np.sin(pitch) * np.sin(yaw), -np.sin(pitch) * np.cos(yaw), np.cos(pitch)], axis=-1)
        most = math.radians(self.bank_deg)
        bank = np.arctan2(np.sum(acceleration * right, axis=1), STANDARD_GRAVITY).clip(-most, most)[:, None]
        return np.asarray(way.axes @ _held(np.cos(bank) * upright + np.sin(bank) * right, yaw))

    def _followed(self, velocity: Floats, rate_hz: float) -> tuple[Floats, Floats]:
        """Heading and pitch (n,), rad, at all whole frames from 0, of velocities (n, 3) m/s."""
        most, steepest = math.radians(self.turn_deg_s) / rate_hz, math.radians(self.steepest_deg)
        slope = np.arctan2(velocity[:, 2], np.linalg.norm(velocity[:, :2], axis=1))
        wanted = slope.clip(-steepest, steepest)
        if self.levels:
            fall = steepest * (math.pi / 2 - np.abs(slope)) / (math.pi / 2 - steepest)
            wanted = np.sign(slope) * np.minimum(np.abs(wanted), fall)
        return _headings(velocity, most), _followed(wanted, np.linalg.norm(velocity, axis=1), most, 0.0)


def _moving(way: Way, frames: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """All whole frames from 0 to the last asked for, and the velocities there; velocities and accelerations at frames
    (n,). Metres and seconds, along the axes of the way."""
    whole = np.arange(math.ceil(frames.max(initial=0.0)) + 1.0)
    moments, places = np.unique(np.concatenate([whole, frames]), return_inverse=True)
    velocity, acceleration = way.motion(moments)
    at_whole, asked = places[: len(whole)], places[len(whole) :]
    return whole, velocity[at_whole], velocity[asked], acceleration[asked]


def _headings(velocity: Floats, most: float) -> Floats:
    """(n,) rad from ahead to the right, one for each whole frame from 0: they follow the horizontal direction of
    velocities (n, 3) m/s by at most `most` rad a frame."""
    level = velocity[:, :2]
    return _followed(np.arctan2(level[:, 0], level[:, 1]), np.linalg.norm(level, axis=1), most, math.pi / 2)


def _followed(wanted: Floats, speed: Floats, most: float, standing: float) -> Floats:
    """(n,) rad: angles that follow those wanted, at speeds (n,) m/s, by at most `most` rad a frame.

    standing  the first one where it stands
    """
    limits = most * np.minimum(speed / TURNING_M_S, 1.0) ** 2
    angle = float(wanted[0]) if speed[0] >= STANDING_M_S else standing
    followed = [angle]
    for goal, limit in zip(wanted[1:].tolist(), limits[1:].tolist(), strict=True):
        angle += min(max(math.remainder(goal - angle, math.tau), -limit), limit)
        followed.append(angle)
    return np.array(followed)


def _held(up: Floats, heading: Floats) -> Floats:
    """(n, 3, 3): body to (right, ahead, up) vectors of bodies with their ups (n, 3), none of them level, at yaw
    (n,) rad."""
    ahead = np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    leant = np.sum(up[:, :2] * ahead, axis=1, keepdims=True)
    nose = np.concatenate([ahead * up[:, 2:], -leant], axis=1)
    nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
    return np.stack([nose, np.cross(nose, up), -up], axis=-1)
