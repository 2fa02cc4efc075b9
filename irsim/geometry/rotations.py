"""Rotations of bodies: Euler angles to matrices and back."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats

AWAY = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Rotation from body to camera vectors of a level body that flies away: x to z, y to x, z to y."""


def euler(angles_deg: Floats) -> Floats:
    """Return the rotations (..., 3, 3) from body to level axes of yaw, pitch, roll (..., 3), degrees."""
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
