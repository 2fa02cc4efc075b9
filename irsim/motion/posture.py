"""How a body lies along its path: as an arrow, an aeroplane, a rotorcraft, or upright."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from irsim.motion.attitude import STANDARD_GRAVITY, euler
from irsim.motion.base import Path
from irsim.stage import Stage
from irsim.types import Floats

STEEPEST_BANK_DEG = 80.0
"""A coordinated turn at this bank pulls 5.8 g: sharper turns of a path do not bank more."""
SMOOTHED_S = 0.5
"""Seconds to each side over which velocity and acceleration of what stands upright or hangs from rotors
are fitted: about as long as a multirotor takes to tilt from level flight into a brake. A steady turn of
1 rad/s seems 2 % weaker for it; places with 5 cm of white noise tilt it by 0.6 degrees."""
LEAST_LIFT = 0.25
"""Rotors pull upwards by at least this share of the weight, however fast a path falls: a choice, so that
a fall leaves a body its up and down."""
TURNING_M_S = 0.5
"""Horizontal speed from which a heading follows it at the full rate; below, the rate goes with its square,
so that what hovers or stands keeps its heading."""
STANDING_M_S = 0.01
"""What is slower than this in frame 0 looks to the camera's right."""

_STEP = 0.5
"""Frames to each side over which an arrow's velocity is taken."""
_ROLL_S = 0.25
"""Seconds to each side over which an aeroplane's acceleration is taken: about as long as a fighter takes
to roll into a bank. A steady turn of 1 rad/s seems 0.5 % weaker for it."""
_STANDING_M = 1e-6
"""An arrow that moves less than this in a frame has no direction of its own."""
_SAMPLES = np.linspace(-SMOOTHED_S, SMOOTHED_S, 11)
"""Seconds around a moment at which a parabola is fitted to the path."""


@dataclass(frozen=True)
class Way:
    """A target's path through a stage; `name` is the target's id, which addresses the path's randomness."""

    path: Path
    stage: Stage
    name: str

    def positions(self, frames: Floats) -> Floats:
        """(n, 3) m, first camera frame, at frame numbers (n,)."""
        return self.path.positions(frames, self.stage, self.name)

    @property
    def axes(self) -> Floats:
        """(3, 3) columns right, ahead (both level) and up, as vectors of the first camera frame."""
        right, down = np.array([1.0, 0.0, 0.0]), self.stage.geometry.down
        return np.stack([right, np.cross(right, down), -down], axis=-1)

    def motion(self, frames: Floats) -> tuple[Floats, Floats]:
        """(n, 3) m/s and (n, 3) m/s2 along `axes`: of the parabola through SMOOTHED_S to both sides, least squares."""
        around = np.add.outer(_SAMPLES * self.stage.rate_hz, frames)
        places = self.positions(around.ravel()).reshape(len(_SAMPLES), len(frames), 3)
        bent = _SAMPLES**2 - np.mean(_SAMPLES**2)
        velocity = _weighed(places, _SAMPLES / np.sum(_SAMPLES**2))
        acceleration = _weighed(places, 2 * bent / np.sum(bent**2))
        return self._along_axes(velocity), self._along_axes(acceleration)

    def _along_axes(self, vectors: Floats) -> Floats:
        return np.asarray(np.sum(vectors[:, :, None] * self.axes, axis=1))


class Posture(ABC):
    """The law by which a body's attitude follows from its path alone, the same for any frames asked for."""

    @abstractmethod
    def bodies(self, way: Way, frames: Floats) -> Floats:
        """(n, 3, 3): body to first camera vectors at frame numbers (n,), which may be fractional."""


@dataclass(frozen=True)
class Arrow(Posture):
    """The nose follows the velocity in space, wings level with the world; one that stands looks to the
    camera's right.

    With `banks` it leans into its turns as coordinated flight does: tan(bank) = v omega / g, which is
    the sideways acceleration over g. A body that flies exactly upwards has no level wings: its roll
    changes at once there.
    """

    banks: bool = False

    def bodies(self, way: Way, frames: Floats) -> Floats:
        wide = _ROLL_S * way.stage.rate_hz
        around = np.add.outer([-wide, -_STEP, 0.0, _STEP, wide], frames).ravel()
        entry, before, here, after, exit = np.split(way.positions(around), 5)
        step = after - before
        length = np.linalg.norm(step, axis=1, keepdims=True)
        nose = np.where(length > 2 * _STEP * _STANDING_M, step, [1.0, 0.0, 0.0])
        nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
        right = np.cross(way.stage.geometry.down, nose)
        level = np.linalg.norm(right, axis=1, keepdims=True)
        right = np.where(level > 1e-9, right / np.maximum(level, 1e-9), np.cross(nose, [1.0, 0.0, 0.0]))
        body = np.stack([nose, right, np.cross(nose, right)], axis=-1)

        acceleration = (entry - 2 * here + exit) / _ROLL_S**2
        sideways = np.sum(acceleration * right, axis=1) if self.banks else np.zeros(len(frames))
        bank = np.degrees(np.arctan2(sideways, STANDARD_GRAVITY)).clip(-STEEPEST_BANK_DEG, STEEPEST_BANK_DEG)
        return np.asarray(body @ euler(bank[:, None] * [0.0, 0.0, 1.0]))


@dataclass(frozen=True)
class Upright(Posture):
    """It stands upright whatever its path, and looks where it goes over the ground; what stands keeps its heading."""

    turn_deg_s: float = 180.0
    """How fast it turns at most, degrees a second: a person about in a second. A choice."""

    def bodies(self, way: Way, frames: Floats) -> Floats:
        whole = np.arange(math.ceil(frames.max(initial=0.0)) + 1.0)
        moments, places = np.unique(np.concatenate([whole, frames]), return_inverse=True)
        velocity, acceleration = way.motion(moments)
        at_whole, asked = places[: len(whole)], places[len(whole) :]
        heading = _headings(velocity[at_whole, :2], math.radians(self.turn_deg_s) / way.stage.rate_hz)
        up = self.ups(velocity[asked], acceleration[asked])
        return np.asarray(way.axes @ _held(up, np.interp(frames, whole, heading)))

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


def _weighed(places: Floats, weights: Floats) -> Floats:
    """(n, 3) sums of places (k, n, 3) by weights (k,); a matrix product's last bits would go with n."""
    return np.asarray(np.sum(places * weights[:, None, None], axis=0))


def _headings(velocity: Floats, most: float) -> Floats:
    """(n,) rad from ahead to the right, one for each whole frame from 0: they follow the direction of horizontal
    velocities (n, 2) m/s by at most `most` rad a frame."""
    speed = np.linalg.norm(velocity, axis=1)
    wanted = np.arctan2(velocity[:, 0], velocity[:, 1])
    limits = most * np.minimum(speed / TURNING_M_S, 1.0) ** 2
    heading = float(wanted[0]) if speed[0] >= STANDING_M_S else math.pi / 2
    followed = [heading]
    for goal, limit in zip(wanted[1:].tolist(), limits[1:].tolist(), strict=True):
        heading += min(max(math.remainder(goal - heading, math.tau), -limit), limit)
        followed.append(heading)
    return np.array(followed)


def _held(up: Floats, heading: Floats) -> Floats:
    """(n, 3, 3): body to (right, ahead, up) vectors of bodies with their ups (n, 3), none of them level, at yaw
    (n,) rad."""
    ahead = np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    leant = np.sum(up[:, :2] * ahead, axis=1, keepdims=True)
    nose = np.concatenate([ahead * up[:, 2:], -leant], axis=1)
    nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
    return np.stack([nose, np.cross(nose, up), -up], axis=-1)


ARROW, AEROPLANE, UPRIGHT = Arrow(), Arrow(banks=True), Upright()
MULTIROTOR = Rotorcraft(speed_m_s=20.0, tilt_deg=35.0, steepest_deg=35.0, turn_deg_s=200.0)
"""DJI Mavic 2, data sheet: at most 72 km/h, 35 degrees of tilt and 200 degrees a second, in its sport mode. At
50 km/h that makes 26 degrees; the data sheet's limit in its other mode is 25."""
HELICOPTER = Rotorcraft(speed_m_s=70.0, tilt_deg=5.0, steepest_deg=60.0, turn_deg_s=60.0)
"""A choice: drag of a twelfth of the weight at a cruise of 136 knots. More bank than 60 degrees is aerobatics
(14 CFR 91.307)."""

PostureName = Literal["arrow", "aeroplane", "multirotor", "helicopter", "upright"]
POSTURES: dict[PostureName, Posture] = {
    "arrow": ARROW,
    "aeroplane": AEROPLANE,
    "multirotor": MULTIROTOR,
    "helicopter": HELICOPTER,
    "upright": UPRIGHT,
}


def attitudes(
    path: Path,
    frames: Floats,
    stage: Stage,
    name: str,
    offset_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spin_deg_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    posture: Posture = ARROW,
) -> Floats:
    """(n, 3, 3): body to first camera vectors of a target at frame numbers (n,).

    The posture says how it lies along its path; offset and spin (yaw, pitch, roll) turn the body about
    its own axes after that.
    """
    frames = np.asarray(frames, dtype=np.float64)
    own = np.asarray(offset_deg) + np.asarray(spin_deg_s) * frames[:, None] / stage.rate_hz
    return np.asarray(posture.bodies(Way(path, stage, name), frames) @ euler(own))
