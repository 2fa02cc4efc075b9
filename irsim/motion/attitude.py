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
from irsim.motion.base import Path
from irsim.types import Floats

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity, m/s2 (CGPM 1901)."""

AWAY = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Body to camera vectors of a level body that flies away: x to z, y to x, z to y."""


def euler(angles_deg: Floats) -> Floats:
    """Return the (..., 3, 3) rotations of (..., 3) yaw, pitch, roll, degrees: body vectors to vectors of the old
    axes."""
    yaw, pitch, roll = np.moveaxis(np.radians(np.asarray(angles_deg, dtype=np.float64)), -1, 0)
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.asarray(np.stack([np.stack(row, axis=-1) for row in rows], axis=-2))


def angles_deg(rotations: Floats) -> Floats:
    """Return the (..., 3) yaw, pitch, roll, degrees, of (..., 3, 3) rotations from body to camera."""
    level = np.asarray(AWAY.T @ np.asarray(rotations))
    yaw = np.arctan2(level[..., 1, 0], level[..., 0, 0])
    pitch = np.arctan2(-level[..., 2, 0], np.hypot(level[..., 0, 0], level[..., 1, 0]))
    roll = np.arctan2(level[..., 2, 1], level[..., 2, 2])
    return np.asarray(np.degrees(np.stack([yaw, pitch, roll], axis=-1)))


SMOOTHED_S = 0.5
"""Half-width of the window in which velocity and acceleration are fitted, s, for every law but `Arrow`: about the time
in which a multirotor tilts from level flight into a brake. The fit underestimates a turn of 1 rad/s by 2 %; positions
with 5 cm of white noise tilt a multirotor by 0.6 degrees."""

_SAMPLES = np.linspace(-SMOOTHED_S, SMOOTHED_S, 11)
"""Times of the samples to which a parabola is fitted, s."""


@dataclass(frozen=True)
class BoundPath:
    """Path of one target in its scene. `name` is the id of the target and addresses the random stream of the path."""

    path: Path
    context: SceneContext
    name: str

    def positions(self, frames: Floats) -> Floats:
        """Return (n, 3) m, first camera frame, at frame numbers (n,)."""
        return self.path.positions(frames, self.context, self.name)

    @property
    def axes(self) -> Floats:
        """Return (3, 3): the columns right, ahead (both level) and up, in the first camera frame."""
        right, down = np.array([1.0, 0.0, 0.0]), self.context.geometry.down
        return np.stack([right, np.cross(right, down), -down], axis=-1)

    def motion(self, frames: Floats) -> tuple[Floats, Floats]:
        """Return velocity (n, 3) m/s and acceleration (n, 3) m/s² along `axes`, by a least-squares parabola."""
        around = np.add.outer(_SAMPLES * self.context.rate_hz, frames)
        places = self.positions(around.ravel()).reshape(len(_SAMPLES), len(frames), 3)
        bent = _SAMPLES**2 - np.mean(_SAMPLES**2)
        velocity = _weighed(places, _SAMPLES / np.sum(_SAMPLES**2))
        acceleration = _weighed(places, 2 * bent / np.sum(bent**2))
        return self._along_axes(velocity), self._along_axes(acceleration)

    def _along_axes(self, vectors: Floats) -> Floats:
        return np.asarray(np.sum(vectors[:, :, None] * self.axes, axis=1))


class Posture(ABC):
    """Law that gives the attitude of a body from its path alone. A frame has the same attitude in every call."""

    @abstractmethod
    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        """Return (n, 3, 3) rotations from body to first camera frame at frame numbers (n,), fractional or not."""


def _weighed(places: Floats, weights: Floats) -> Floats:
    """Return (n, 3) sums of positions (k, n, 3) by weights (k,). A matrix product would round differently with n."""
    return np.asarray(np.sum(places * weights[:, None, None], axis=0))


LEAST_LIFT = 0.25
"""Least lift of the rotors as a share of the weight, a choice: it keeps up and down defined on a path in free fall."""
TURNING_M_S = 0.5
"""Speed above which heading and pitch follow the velocity at the full rate, m/s. Below it the rate falls with the
square of the speed, so a hovering body keeps its heading."""
STANDING_M_S = 0.01
"""Speed, m/s, below which a body in frame 0 is level and faces right of the camera."""


@dataclass(frozen=True)
class Upright(Posture):
    """Upright body that faces along its horizontal velocity; at rest it keeps its heading."""

    turn_deg_s: float = 180.0
    """Largest turn rate, degrees a second. The default is a choice: a person turns about in one second."""

    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        whole, before, velocity, acceleration = _moving(bound, frames)
        heading = _headings(before, math.radians(self.turn_deg_s) / bound.context.rate_hz)
        return np.asarray(bound.axes @ _held(self.ups(velocity, acceleration), np.interp(frames, whole, heading)))

    def ups(self, velocity: Floats, acceleration: Floats) -> Floats:
        """Return the body's up axis, (n, 3) unit vectors, from (n, 3) m/s and (n, 3) m/s², all as (right, ahead,
        up)."""
        return np.broadcast_to([0.0, 0.0, 1.0], velocity.shape)


@dataclass(frozen=True, kw_only=True)
class Rotorcraft(Upright):
    """Rotorcraft: the thrust acts along the body's up axis, so up is parallel to a + g + d v_h.

    The sum balances acceleration, weight and the drag of the horizontal speed. The body is level in hover and in a
    steady climb, pitches down by atan(d v / g) at a steady speed, pitches up while braking, and banks by
    atan(v omega / g) in a turn. Rotor drag is proportional to speed (Faessler, Franchi, Scaramuzza, IEEE RA-L 3(2),
    2018) and is set by the tilt at one speed: d = g tan(tilt) / speed.
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
    """Body whose nose follows the velocity in heading and, within bounds, in pitch.

    The body never inverts: when the velocity passes through the vertical, the heading turns at its largest rate.
    """

    steepest_deg: float
    """Largest pitch up or down, degrees."""
    levels: bool = False
    """True if the pitch decreases again for paths steeper than that, to level for a vertical path."""
    bank_deg: float = 0.0
    """Largest bank, degrees. The bank is that of coordinated flight: tan(bank) = lateral acceleration / g."""

    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        whole, before, _, acceleration = _moving(bound, frames)
        yaw, pitch = (np.interp(frames, whole, angle) for angle in self._followed(before, bound.context.rate_hz))
        level = np.zeros(len(frames))
        right = np.stack([np.cos(yaw), -np.sin(yaw), level], axis=-1)
        upright = np.stack([-np.sin(pitch) * np.sin(yaw), -np.sin(pitch) * np.cos(yaw), np.cos(pitch)], axis=-1)
        most = math.radians(self.bank_deg)
        bank = np.arctan2(np.sum(acceleration * right, axis=1), STANDARD_GRAVITY).clip(-most, most)[:, None]
        return np.asarray(bound.axes @ _held(np.cos(bank) * upright + np.sin(bank) * right, yaw))

    def _followed(self, velocity: Floats, rate_hz: float) -> tuple[Floats, Floats]:
        """Return heading and pitch (n,), rad, at whole frames from 0, for velocities (n, 3) m/s."""
        most, steepest = math.radians(self.turn_deg_s) / rate_hz, math.radians(self.steepest_deg)
        slope = np.arctan2(velocity[:, 2], np.linalg.norm(velocity[:, :2], axis=1))
        wanted = slope.clip(-steepest, steepest)
        if self.levels:
            fall = steepest * (math.pi / 2 - np.abs(slope)) / (math.pi / 2 - steepest)
            wanted = np.sign(slope) * np.minimum(np.abs(wanted), fall)
        return _headings(velocity, most), _followed(wanted, np.linalg.norm(velocity, axis=1), most, 0.0)


def _moving(bound: BoundPath, frames: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the whole frames from 0, the velocities there, and velocities and accelerations at `frames` (n,).

    Units are m and s, along the axes of the path.
    """
    whole = np.arange(math.ceil(frames.max(initial=0.0)) + 1.0)
    moments, places = np.unique(np.concatenate([whole, frames]), return_inverse=True)
    velocity, acceleration = bound.motion(moments)
    at_whole, asked = places[: len(whole)], places[len(whole) :]
    return whole, velocity[at_whole], velocity[asked], acceleration[asked]


def _headings(velocity: Floats, most: float) -> Floats:
    """Return headings (n,), rad from ahead to the right, at whole frames from 0.

    They follow the horizontal direction of velocities (n, 3) m/s by at most `most` rad a frame.
    """
    level = velocity[:, :2]
    return _followed(np.arctan2(level[:, 0], level[:, 1]), np.linalg.norm(level, axis=1), most, math.pi / 2)


def _followed(wanted: Floats, speed: Floats, most: float, standing: float) -> Floats:
    """Return angles (n,), rad, that follow `wanted` by at most `most` rad a frame at speeds (n,) m/s.

    standing  the first angle of a body at rest
    """
    limits = most * np.minimum(speed / TURNING_M_S, 1.0) ** 2
    angle = float(wanted[0]) if speed[0] >= STANDING_M_S else standing
    followed = [angle]
    for goal, limit in zip(wanted[1:].tolist(), limits[1:].tolist(), strict=True):
        angle += min(max(math.remainder(goal - angle, math.tau), -limit), limit)
        followed.append(angle)
    return np.array(followed)


def _held(up: Floats, heading: Floats) -> Floats:
    """Return (n, 3, 3) rotations from body to (right, ahead, up), for up axes (n, 3), none level, at yaw (n,) rad."""
    ahead = np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    leant = np.sum(up[:, :2] * ahead, axis=1, keepdims=True)
    nose = np.concatenate([ahead * up[:, 2:], -leant], axis=1)
    nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
    return np.stack([nose, np.cross(nose, up), -up], axis=-1)


STEEPEST_BANK_DEG = 80.0
"""Largest bank of an aeroplane, degrees: a coordinated turn at this bank pulls 5.8 g."""

_STEP = 0.5
"""Half-width of the central difference that gives the velocity of an arrow, frames."""
_ROLL_S = 0.25
"""Half-width of the central difference that gives the acceleration of an aeroplane, s: about the time in which a
fighter rolls into a bank. It underestimates a turn of 1 rad/s by 0.5 %."""
_STANDING_M = 1e-6
"""Least displacement per frame, m, that gives an arrow a direction."""


@dataclass(frozen=True)
class Arrow(Posture):
    """Body whose nose lies along the velocity, with level wings. At rest it faces right of the camera.

    With `banks` it banks as in coordinated flight: tan(bank) = v omega / g, the lateral acceleration over g. Level
    wings are undefined in vertical flight, so the roll may jump there.
    """

    banks: bool = False

    def bodies(self, bound: BoundPath, frames: Floats) -> Floats:
        wide = _ROLL_S * bound.context.rate_hz
        around = np.add.outer([-wide, -_STEP, 0.0, _STEP, wide], frames).ravel()
        entry, before, here, after, exit = np.split(bound.positions(around), 5)
        step = after - before
        length = np.linalg.norm(step, axis=1, keepdims=True)
        nose = np.where(length > 2 * _STEP * _STANDING_M, step, [1.0, 0.0, 0.0])
        nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
        right = np.cross(bound.context.geometry.down, nose)
        level = np.linalg.norm(right, axis=1, keepdims=True)
        right = np.where(level > 1e-9, right / np.maximum(level, 1e-9), np.cross(nose, [1.0, 0.0, 0.0]))
        body = np.stack([nose, right, np.cross(nose, right)], axis=-1)

        acceleration = (entry - 2 * here + exit) / _ROLL_S**2
        sideways = np.sum(acceleration * right, axis=1) if self.banks else np.zeros(len(frames))
        bank = np.degrees(np.arctan2(sideways, STANDARD_GRAVITY)).clip(-STEEPEST_BANK_DEG, STEEPEST_BANK_DEG)
        return np.asarray(body @ euler(bank[:, None] * [0.0, 0.0, 1.0]))


ARROW, AEROPLANE, UPRIGHT = Arrow(), Arrow(banks=True), Upright()
MULTIROTOR = Rotorcraft(speed_m_s=20.0, tilt_deg=35.0, steepest_deg=35.0, turn_deg_s=200.0)
"""DJI Mavic 2, data sheet: at most 72 km/h, 35 degrees of tilt and 200 degrees a second, in its sport mode. The model
tilts by 26 degrees at 50 km/h; the limit of the other mode on the data sheet is 25."""
HELICOPTER = Rotorcraft(speed_m_s=70.0, tilt_deg=5.0, steepest_deg=60.0, turn_deg_s=60.0)
"""A choice: drag of a twelfth of the weight at a cruise of 136 knots. More bank than 60 degrees is aerobatics
(14 CFR 91.307)."""
BIRD = Pitched(steepest_deg=60.0, bank_deg=60.0, turn_deg_s=180.0)
"""Choices: a bird that turns at a bank of 60 degrees carries twice its weight."""
VEHICLE = Pitched(steepest_deg=31.0, levels=True, turn_deg_s=60.0)
"""Tanks climb gradients of 60 %, 31 degrees (Leopard 2, data sheet); roads are far less steep. The rate is a choice. A
steeper path does not follow the ground, such as one up or down the picture at a constant range."""

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
