"""How a body lies along its path.

Body axes: x forward, y right, z down. Angles are yaw, pitch, roll in that order (z-y'-x'', as
aircraft count them: ISO 1151-1), against a level body that flies away along the first camera's
axis: yaw turns the nose right, pitch lifts it, roll lowers the right wing.
"""

from __future__ import annotations

import numpy as np

from irsim.motion.base import Path
from irsim.stage import Stage
from irsim.types import Floats

STANDARD_GRAVITY = 9.80665
"""m/s2, CGPM 1901."""
STEEPEST_BANK_DEG = 80.0
"""A coordinated turn at this bank pulls 5.8 g: sharper turns of a path do not bank more."""

_AWAY = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Body to camera vectors of a level body that flies away: x to z, y to x, z to y."""
_STEP = 0.5
"""Frames to each side over which the velocity is taken."""
_ROLL_S = 0.25
"""Seconds to each side over which the acceleration is taken: about as long as a fighter takes to roll
into a bank. A steady turn of 1 rad/s seems 0.5 % weaker for it."""
_STANDING_M = 1e-6
"""A body that moves less than this in a frame has no direction of its own."""


def euler(angles_deg: Floats) -> Floats:
    """(..., 3, 3): body vectors after (..., 3) yaw, pitch, roll degrees, to vectors of the axes before."""
    yaw, pitch, roll = np.moveaxis(np.radians(np.asarray(angles_deg, dtype=np.float64)), -1, 0)
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.asarray(np.stack([np.stack(row, axis=-1) for row in rows], axis=-2))


def angles_deg(rotations: Floats) -> Floats:
    """(..., 3) yaw, pitch, roll degrees of (..., 3, 3) body to camera rotations."""
    level = np.asarray(_AWAY.T @ np.asarray(rotations))
    yaw = np.arctan2(level[..., 1, 0], level[..., 0, 0])
    pitch = np.arctan2(-level[..., 2, 0], np.hypot(level[..., 0, 0], level[..., 1, 0]))
    roll = np.arctan2(level[..., 2, 1], level[..., 2, 2])
    return np.asarray(np.degrees(np.stack([yaw, pitch, roll], axis=-1)))


def attitudes(
    path: Path,
    frames: Floats,
    stage: Stage,
    name: str,
    offset_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spin_deg_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    banks: bool = False,
) -> Floats:
    """(n, 3, 3): body to first camera vectors of a target at frame numbers (n,).

    The nose follows the velocity in space, wings level with the world; a body that stands looks to
    the camera's right. With `banks` it leans into its turns as coordinated flight does: tan(bank) =
    v omega / g, which is the sideways acceleration over g. Offset and spin (yaw, pitch, roll) turn
    the body about its own axes after that. A body that flies exactly upwards has no level wings:
    its roll changes at once there.
    """
    frames = np.asarray(frames, dtype=np.float64)
    wide = _ROLL_S * stage.rate_hz
    around = np.add.outer([-wide, -_STEP, 0.0, _STEP, wide], frames).ravel()
    entry, before, here, after, exit = np.split(path.positions(around, stage, name), 5)
    step = after - before
    length = np.linalg.norm(step, axis=1, keepdims=True)
    nose = np.where(length > 2 * _STEP * _STANDING_M, step, [1.0, 0.0, 0.0])
    nose = nose / np.linalg.norm(nose, axis=1, keepdims=True)
    right = np.cross(stage.geometry.down, nose)
    level = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(level > 1e-9, right / np.maximum(level, 1e-9), np.cross(nose, [1.0, 0.0, 0.0]))
    body = np.stack([nose, right, np.cross(nose, right)], axis=-1)

    acceleration = (entry - 2 * here + exit) / _ROLL_S**2
    sideways = np.sum(acceleration * right, axis=1) if banks else np.zeros(len(frames))
    bank = np.degrees(np.arctan2(sideways, STANDARD_GRAVITY)).clip(-STEEPEST_BANK_DEG, STEEPEST_BANK_DEG)
    own = np.asarray(offset_deg) + np.asarray(spin_deg_s) * frames[:, None] / stage.rate_hz
    return np.asarray(body @ euler(bank[:, None] * [0.0, 0.0, 1.0]) @ euler(own))
