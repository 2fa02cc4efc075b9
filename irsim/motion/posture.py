"""How a body lies along its path: as an arrow, an aeroplane, a bird, a rotorcraft, a vehicle, or upright."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.motion.attitude import STANDARD_GRAVITY, euler
from irsim.motion.base import Path
from irsim.motion.upright import Pitched, Rotorcraft, Upright
from irsim.motion.way import Posture, Way
from irsim.types import Floats

__all__ = ["ARROW", "POSTURES", "Posture", "PostureName", "attitudes"]

STEEPEST_BANK_DEG = 80.0
"""A coordinated turn at this bank pulls 5.8 g: sharper turns of a path do not bank more."""

_STEP = 0.5
"""Frames to each side over which an arrow's velocity is taken."""
_ROLL_S = 0.25
"""Seconds to each side over which an aeroplane's acceleration is taken: about as long as a fighter takes
to roll into a bank. A steady turn of 1 rad/s seems 0.5 % weaker for it."""
_STANDING_M = 1e-6
"""An arrow that moves less than this in a frame has no direction of its own."""


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
        wide = _ROLL_S * way.context.rate_hz
        around = np.add.outer([-wide, -_STEP, 0.0, _STEP, wide], frames).ravel()
        entry, before, here, after, exit = np.split(way.positions(around), 5)
        step = after - before
        length = np.linalg.norm(step, axis=1, keepdims=True)
        nose = np.where(length > 2 * _STEP * _STANDING_M, step, [1.0, 0.0, 0.0])
        nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
        right = np.cross(way.context.geometry.down, nose)
        level = np.linalg.norm(right, axis=1, keepdims=True)
        right = np.where(level > 1e-9, right / np.maximum(level, 1e-9), np.cross(nose, [1.0, 0.0, 0.0]))
        body = np.stack([nose, right, np.cross(nose, right)], axis=-1)

        acceleration = (entry - 2 * here + exit) / _ROLL_S**2
        sideways = np.sum(acceleration * right, axis=1) if self.banks else np.zeros(len(frames))
        bank = np.degrees(np.arctan2(sideways, STANDARD_GRAVITY)).clip(-STEEPEST_BANK_DEG, STEEPEST_BANK_DEG)
        return np.asarray(body @ euler(bank[:, None] * [0.0, 0.0, 1.0]))


ARROW, AEROPLANE, UPRIGHT = Arrow(), Arrow(banks=True), Upright()
MULTIROTOR = Rotorcraft(speed_m_s=20.0, tilt_deg=35.0, steepest_deg=35.0, turn_deg_s=200.0)
"""DJI Mavic 2, data sheet: at most 72 km/h, 35 degrees of tilt and 200 degrees a second, in its sport mode. At
50 km/h that makes 26 degrees; the data sheet's limit in its other mode is 25."""
HELICOPTER = Rotorcraft(speed_m_s=70.0, tilt_deg=5.0, steepest_deg=60.0, turn_deg_s=60.0)
"""A choice: drag of a twelfth of the weight at a cruise of 136 knots. More bank than 60 degrees is aerobatics
(14 CFR 91.307)."""
BIRD = Pitched(steepest_deg=60.0, bank_deg=60.0, turn_deg_s=180.0)
"""Choices: a bird that turns at a bank of 60 degrees carries twice its weight."""
VEHICLE = Pitched(steepest_deg=31.0, levels=True, turn_deg_s=60.0)
"""Tanks climb gradients of 60 %, 31 degrees (Leopard 2, data sheet), roads and their vehicles stay far below; the rate
is a choice. A steeper course than that is no ground's: it is up or down the picture, at a range that stays."""

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
    """(n, 3, 3): body to first camera vectors of a target at frame numbers (n,).

    The posture says how it lies along its path; offset and spin (yaw, pitch, roll) turn the body about
    its own axes after that.
    """
    frames = np.asarray(frames, dtype=np.float64)
    own = np.asarray(offset_deg) + np.asarray(spin_deg_s) * frames[:, None] / context.rate_hz
    return np.asarray(posture.bodies(Way(path, context, name), frames) @ euler(own))
