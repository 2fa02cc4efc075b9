"""Rotations of bodies as angles.

Body axes: x forward, y right, z down. Angles are yaw, pitch, roll in that order (z-y'-x'', as
aircraft count them: ISO 1151-1), against a level body that flies away along the first camera's
axis: yaw turns the nose right, pitch lifts it, roll lowers the right wing.
"""

from __future__ import annotations

import numpy as np

from irsim.types import Floats

STANDARD_GRAVITY = 9.80665
"""m/s2, CGPM 1901."""

AWAY = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Body to camera vectors of a level body that flies away: x to z, y to x, z to y."""


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
    level = np.asarray(AWAY.T @ np.asarray(rotations))
    yaw = np.arctan2(level[..., 1, 0], level[..., 0, 0])
    pitch = np.arctan2(-level[..., 2, 0], np.hypot(level[..., 0, 0], level[..., 1, 0]))
    roll = np.arctan2(level[..., 2, 1], level[..., 2, 2])
    return np.asarray(np.degrees(np.stack([yaw, pitch, roll], axis=-1)))
