"""Attitude of a body along its path: Euler angles, and one law for each class of target.

Body axes: x forward, y right, z down. Angles are yaw, pitch, roll in that order (z-y'-x'', ISO 1151-1), relative to a
level body that flies away along the first camera's axis: yaw turns the nose right, pitch lifts it, roll lowers the
right wing.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.rotations import euler
from irsim.motion.base import Path
from irsim.types import Floats

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s2 (CGPM 1901)."""


SMOOTHED_S = 0.5
"""Half-width of the window in which velocity and acceleration are fitted, s, for every law but `Arrow`: about the time
in which a multirotor tilts from level flight into a brake. The fit underestimates a turn of 1 rad/s by 2 %."""
_SAMPLES = np.linspace(-SMOOTHED_S, SMOOTHED_S, 11)
"""Times of the samples to which a parabola is fitted, s."""


@dataclass(frozen=True)
class BoundPath:
    """Path of one target in its scene. `name` is the id of the target and addresses the random stream of the path."""

    path: Path
    context: SceneContext
    name: str

    def positions(self, frames: Floats) -> Floats:
        """Return positions (n, 3), m in the first camera frame, at frame numbers (n,)."""
        return self.path.positions(frames, self.context, self.name)

    @property
    def axes(self) -> Floats:
        """Matrix (3, 3) with the columns right, ahead (both level) and up, in the first camera frame."""
        right, down = np.array([1.0, 0.0, 0.0]), self.context.geometry.down
        return np.stack([right, np.cross(right, down), -down], axis=-1)

    def motion(self, frames: Floats) -> tuple[Floats, Floats]:
        """Return velocity (n, 3) m/s and acceleration (n, 3) m/s² along `axes`, by a least-squares parabola."""
        times = np.add.outer(_SAMPLES * self.context.rate_hz, frames)
        positions = self.positions(times.ravel()).reshape(len(_SAMPLES), len(frames), 3)
        square = _SAMPLES**2 - np.mean(_SAMPLES**2)
        velocity = _weighted_sum(positions, _SAMPLES / np.sum(_SAMPLES**2))
        acceleration = _weighted_sum(positions, 2 * square / np.sum(square**2))
        return self._along_axes(velocity), self._along_axes(acceleration)

    def _along_axes(self, vectors: Floats) -> Floats:
        return np.asarray(np.sum(vectors[:, :, None] * self.axes, axis=1))


class Posture(ABC):
    """Law that gives the attitude of a body from its path, for each frame independently of the others in the call."""

    @abstractmethod
    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        """Return (n, 3, 3) rotations from body to first camera frame at frame numbers (n,), fractional or not."""


def _weighted_sum(positions: Floats, weights: Floats) -> Floats:
    """Return (n, 3) sums of positions (k, n, 3) by weights (k,). A matrix product would round differently with n."""
    return np.asarray(np.sum(positions * weights[:, None, None], axis=0))


LEAST_LIFT = 0.25
"""Least lift of the rotors as a share of the weight. It is a choice, with which the body's up axis is defined in free
fall too."""
TURNING_M_S = 0.5
"""Speed above which heading and pitch follow the velocity at the full turn rate, m/s. Below it the turn rate falls with
the square of the speed, so a hovering body keeps its heading."""
STANDING_M_S = 0.01
"""Speed, m/s, below which a body in frame 0 is level and heads to the camera's right."""


@dataclass(frozen=True)
class Upright(Posture):
    """Upright body that faces along its horizontal velocity; at rest it keeps its heading."""

    turn_deg_s: float = 180.0
    """Largest turn rate, degrees a second. The default is a choice: a person turns about in one second."""

    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        whole, at_whole, velocity, acceleration = _sampled(bound, frames)
        heading = _headings(at_whole, math.radians(self.turn_deg_s) / bound.context.rate_hz)
        return np.asarray(bound.axes @ _body_axes(self.ups(velocity, acceleration), np.interp(frames, whole, heading)))

    def ups(self, velocity: Floats, acceleration: Floats) -> Floats:
        """Return the body's up axes, unit vectors, from velocity, m/s, and acceleration, m/s²; each (n, 3) right,
        ahead, up."""
        return np.broadcast_to([0.0, 0.0, 1.0], velocity.shape)


@dataclass(frozen=True, kw_only=True)
class Rotorcraft(Upright):
    """Rotorcraft, whose thrust acts along the body's up axis.

    Up is parallel to the thrust per mass, a + g + d v_h, which causes the acceleration a and balances gravity (g
    upwards) and the drag of the horizontal velocity v_h. The body is level in hover and in a steady climb, pitches down
    by atan(d v / g) at a steady speed, pitches up while braking, and banks by atan(v omega / g) in a turn. Rotor drag
    is proportional to speed (Faessler, Franchi, Scaramuzza, IEEE RA-L 3(2), 2018) and is set by the tilt at one speed:
    d = g tan(tilt) / speed.
    """

    speed_m_s: float
    tilt_deg: float
    """Tilt in steady level flight at `speed_m_s`, degrees."""
    steepest_deg: float
    """Largest tilt, degrees. The horizontal force is limited accordingly, so an infeasible loop does not flip the
    body."""

    def ups(self, velocity: Floats, acceleration: Floats) -> Floats:
        drag = STANDARD_GRAVITY * math.tan(math.radians(self.tilt_deg)) / self.speed_m_s
        force = acceleration + drag * velocity * [1.0, 1.0, 0.0]
        largest = STANDARD_GRAVITY * math.tan(math.radians(self.steepest_deg))
        force *= largest / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), largest)
        push = force[:, :2]
        lift = np.maximum(force[:, 2] + STANDARD_GRAVITY, LEAST_LIFT * STANDARD_GRAVITY)
        length = np.linalg.norm(push, axis=1)
        tilt = np.minimum(np.arctan2(length, lift), math.radians(self.steepest_deg))
        level = push * (np.sin(tilt) / np.maximum(length, np.finfo(float).tiny))[:, None]
        return np.concatenate([level, np.cos(tilt)[:, None]], axis=1)


@dataclass(frozen=True, kw_only=True)
class Pitched(Upright):
    """Body whose nose follows the velocity in heading and, within bounds, in pitch.

    The body never inverts: when the velocity passes through the vertical, the heading turns at its largest rate.
    """

    steepest_deg: float
    """Largest pitch up or down, degrees."""
    levels: bool = False
    """True if the pitch falls again on paths steeper than `steepest_deg`, down to level on a vertical path."""
    bank_deg: float = 0.0
    """Largest bank, degrees. The bank follows from coordinated flight: tan(bank) = lateral acceleration / g."""

    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        whole, at_whole, _, acceleration = _sampled(bound, frames)
        yaw, pitch = (np.interp(frames, whole, angle) for angle in self._yaw_pitch(at_whole, bound.context.rate_hz))
        level = np.zeros(len(frames))
        right = np.stack([np.cos(yaw), -np.sin(yaw), level], axis=-1)
        upright = np.stack([-np.sin(pitch) * np.sin(yaw), -np.sin(pitch) * np.cos(yaw), np.cos(pitch)], axis=-1)
        limit = math.radians(self.bank_deg)
        bank = np.arctan2(np.sum(acceleration * right, axis=1), STANDARD_GRAVITY).clip(-limit, limit)[:, None]
        return np.asarray(bound.axes @ _body_axes(np.cos(bank) * upright + np.sin(bank) * right, yaw))

    def _yaw_pitch(self, velocity: Floats, rate_hz: float) -> tuple[Floats, Floats]:
        """Return heading and pitch (n,), rad, at whole frames from 0, for velocities (n, 3) m/s."""
        limit, steepest = math.radians(self.turn_deg_s) / rate_hz, math.radians(self.steepest_deg)
        slope = np.arctan2(velocity[:, 2], np.linalg.norm(velocity[:, :2], axis=1))
        pitch = slope.clip(-steepest, steepest)
        if self.levels:
            fall = steepest * (math.pi / 2 - np.abs(slope)) / (math.pi / 2 - steepest)
            pitch = np.sign(slope) * np.minimum(np.abs(pitch), fall)
        return _headings(velocity, limit), _rate_limited(pitch, np.linalg.norm(velocity, axis=1), limit, 0.0)


def _sampled(bound: BoundPath, frames: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the whole frames from 0, the velocities there, and velocities and accelerations at `frames` (n,).

    Units are m and s, along the axes of the path.
    """
    whole = np.arange(math.ceil(frames.max(initial=0.0)) + 1.0)
    times, numbers = np.unique(np.concatenate([whole, frames]), return_inverse=True)
    velocity, acceleration = bound.motion(times)
    at_whole, at_frames = numbers[: len(whole)], numbers[len(whole) :]
    return whole, velocity[at_whole], velocity[at_frames], acceleration[at_frames]


def _headings(velocity: Floats, limit: float) -> Floats:
    """Return headings (n,), rad from ahead to the right, at whole frames from 0.

    They follow the horizontal direction of velocities (n, 3) m/s by at most `limit` rad a frame.
    """
    level = velocity[:, :2]
    return _rate_limited(np.arctan2(level[:, 0], level[:, 1]), np.linalg.norm(level, axis=1), limit, math.pi / 2)


def _rate_limited(angles: Floats, speed: Floats, limit: float, at_rest: float) -> Floats:
    """Return angles (n,), rad, that follow `angles` by at most `limit` rad a frame at speeds (n,) m/s.

    at_rest  the first angle of a body at rest
    """
    limits = limit * np.minimum(speed / TURNING_M_S, 1.0) ** 2
    angle = float(angles[0]) if speed[0] >= STANDING_M_S else at_rest
    followed = [angle]
    for goal, most in zip(angles[1:].tolist(), limits[1:].tolist(), strict=True):
        angle += min(max(math.remainder(goal - angle, math.tau), -most), most)
        followed.append(angle)
    return np.array(followed)


def _body_axes(up: Floats, heading: Floats) -> Floats:
    """Return rotations (n, 3, 3) from body to (right, ahead, up), for up axes (n, 3), none of them level, and yaw (n,),
    rad."""
    ahead = np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    sink = np.sum(up[:, :2] * ahead, axis=1, keepdims=True)
    nose = np.concatenate([ahead * up[:, 2:], -sink], axis=1)
    nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
    return np.stack([nose, np.cross(nose, up), -up], axis=-1)


STEEPEST_BANK_DEG = 80.0
"""Largest bank of an aeroplane, degrees: a coordinated turn at this bank pulls 5.8 g."""

_STEP = 0.5
"""Half-width of the central difference that gives the velocity of an arrow, frames."""
_ROLL_S = 0.25
"""Half-width of the second difference that gives the acceleration of an aeroplane, s: about the time in which a fighter
rolls into a bank. It underestimates a turn of 1 rad/s by 0.5 %."""
_STANDING_M = 1e-6
"""Least displacement per frame, m, that gives an arrow a direction."""


@dataclass(frozen=True)
class Arrow(Posture):
    """Body whose nose lies along the velocity, with level wings. At rest it heads to the camera's right.

    With `banks` it banks as in coordinated flight: tan(bank) = v omega / g, the lateral acceleration over g. Level
    wings are undefined in vertical flight, so the roll may jump there.
    """

    banks: bool = False

    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        roll = _ROLL_S * bound.context.rate_hz
        times = np.add.outer([-roll, -_STEP, 0.0, _STEP, roll], frames).ravel()
        earlier, before, here, after, later = np.split(bound.positions(times), 5)
        step = after - before
        length = np.linalg.norm(step, axis=1, keepdims=True)
        nose = np.where(length > 2 * _STEP * _STANDING_M, step, [1.0, 0.0, 0.0])
        nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
        right = np.cross(bound.context.geometry.down, nose)
        level = np.linalg.norm(right, axis=1, keepdims=True)
        right = np.where(level > 1e-9, right / np.maximum(level, 1e-9), np.cross(nose, [1.0, 0.0, 0.0]))
        body = np.stack([nose, right, np.cross(nose, right)], axis=-1)

        acceleration = (earlier - 2 * here + later) / _ROLL_S**2
        sideways = np.sum(acceleration * right, axis=1) if self.banks else np.zeros(len(frames))
        bank = np.degrees(np.arctan2(sideways, STANDARD_GRAVITY)).clip(-STEEPEST_BANK_DEG, STEEPEST_BANK_DEG)
        return np.asarray(body @ euler(bank[:, None] * [0.0, 0.0, 1.0]))


ARROW, AEROPLANE, UPRIGHT = Arrow(), Arrow(banks=True), Upright()
MULTIROTOR = Rotorcraft(speed_m_s=20.0, tilt_deg=35.0, steepest_deg=35.0, turn_deg_s=200.0)
"""DJI Mavic 2, data sheet: at most 72 km/h, 35 degrees of tilt and 200 degrees a second, in its sport mode."""
HELICOPTER = Rotorcraft(speed_m_s=70.0, tilt_deg=5.0, steepest_deg=60.0, turn_deg_s=60.0)
"""A choice: drag of a twelfth of the weight at a cruise of 136 knots; tilting by more than 60 degrees is aerobatics (14
CFR 91.307)."""
BIRD = Pitched(steepest_deg=60.0, bank_deg=60.0, turn_deg_s=180.0)
"""Choices: a bird that turns at a bank of 60 degrees carries twice its weight."""
VEHICLE = Pitched(steepest_deg=31.0, levels=True, turn_deg_s=60.0)
"""Tanks climb gradients of 60 %, 31 degrees (Leopard 2, data sheet). The turn rate is a choice. Steeper paths, such as
one up the picture at a constant range, do not follow the ground."""

PostureName = Literal["arrow", "aeroplane", "bird", "multirotor", "helicopter", "vehicle", "upright"]
POSTURES: dict[PostureName, Posture] = {
    "arrow": ARROW,
    "aeroplane": AEROPLANE,
    "bird": BIRD,
    "multirotor": MULTIROTOR,
    "helicopter": HELICOPTER,
    "vehicle": VEHICLE,
    "upright": UPRIGHT,
}


def attitudes(
    path: Path,
    frames: Floats,
    context: SceneContext,
    name: str,
    offset_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spin_deg_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    posture: Posture = ARROW,
) -> Floats:
    """Return (n, 3, 3) rotations from body to first camera frame of a target at frame numbers (n,).

    The posture gives the attitude along the path; offset and spin (yaw, pitch, roll) then rotate the body about its
    own axes.
    """
    frames = np.asarray(frames, dtype=np.float64)
    own = np.asarray(offset_deg) + np.asarray(spin_deg_s) * frames[:, None] / context.rate_hz
    return np.asarray(posture.bodies(BoundPath(path, context, name), frames) @ euler(own))
