"""Pinhole projection: directions, pixels, and the rotation of the camera.

Frames of reference (right-handed, metres):
    camera   x right, y down, z along the optical axis
    first    camera frame at the first pointing, before any motion; paths in metres are given in it
    world    x east (right of the first azimuth), y down, z level ahead at the first azimuth; it differs from `first`
             only by the first elevation
The pixel of a camera-frame point is principal + (x/z, y/z)/ifov, so the IFOV holds at the axis. The principal point is
the middle of the frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from irsim.types import Floats, Pose, read_only

SINGLE_THREADED = 2**18
"""Multiplications of one matrix product up to which OpenBLAS, numpy's library, stays on one thread (SMP_THRESHOLD_MIN
times GEMM_MULTITHREAD_THRESHOLD in its interface/gemm.c). If several processes share the cores, threads of OpenBLAS
wait milliseconds for each other."""

MIN_ROWS = 8
"""Least number of rows of a block: with smaller blocks the product takes longer than on several threads."""


def blocked_matmul(left: Floats, right: Floats) -> Floats:
    """Return left (..., m, k) @ right (..., k, n), computed in blocks of rows that keep OpenBLAS on one thread."""
    rows, step = left.shape[-2], max(SINGLE_THREADED // max(right.shape[-2] * right.shape[-1], 1), MIN_ROWS)
    if rows <= step:
        return np.asarray(left @ right)
    stack = np.broadcast_shapes(left.shape[:-2], right.shape[:-2])
    out = np.empty((*stack, rows, right.shape[-1]), np.result_type(left, right))
    for begin in range(0, rows, step):
        block = slice(begin, begin + step)
        np.matmul(left[..., block, :], right, out=out[..., block, :])
    return out


def gimbal(azimuth: float | Floats, elevation: float | Floats, roll: float | Floats) -> Floats:
    """Return the rotation (..., 3, 3) from world to camera vectors; angles (...) are in radians, positive right, up,
    clockwise.

    Azimuth turns about the world's vertical, elevation about the level axis, roll about the optical axis.
    """
    turn, lift, twist = np.zeros((3, *np.shape(azimuth), 3, 3))
    turn[..., 0, 0] = turn[..., 2, 2] = np.cos(azimuth)
    turn[..., 2, 0] = np.sin(azimuth)
    lift[..., 1, 1] = lift[..., 2, 2] = np.cos(elevation)
    lift[..., 1, 2] = np.sin(elevation)
    twist[..., 0, 0] = twist[..., 1, 1] = np.cos(roll)
    twist[..., 0, 1] = np.sin(roll)
    turn[..., 0, 2], lift[..., 2, 1], twist[..., 1, 0] = -turn[..., 2, 0], -lift[..., 1, 2], -twist[..., 0, 1]
    turn[..., 1, 1] = lift[..., 0, 0] = twist[..., 2, 2] = 1
    return np.asarray(twist @ lift @ turn)


@lru_cache(maxsize=16)
def _lifted(elevation: float) -> Floats:
    """Return the rotation of the first pointing; cached for all frames."""
    return read_only(gimbal(0.0, elevation, 0.0))


@dataclass(frozen=True)
class Geometry:
    """Pinhole projection of a camera.

    size           (columns, rows)
    ifov_rad       radians a pixel at the axis
    elevation_rad  of the first pointing
    shift_px       (right, down) offset of the optical axis from the middle of the frame
    """

    size: tuple[int, int]
    ifov_rad: float
    elevation_rad: float = 0.0
    shift_px: tuple[float, float] = (0.0, 0.0)

    @property
    def principal(self) -> Floats:
        """Principal point (2,) px."""
        return np.array(self.axis_px)

    @property
    def axis_px(self) -> tuple[float, float]:
        """Principal point (x, y) px as plain numbers."""
        return (self.size[0] - 1) / 2 + self.shift_px[0], (self.size[1] - 1) / 2 + self.shift_px[1]

    @property
    def down(self) -> Floats:
        """Unit vector (3,) downwards in the first camera frame."""
        return np.asarray(gimbal(0.0, self.elevation_rad, 0.0) @ [0.0, 1.0, 0.0])

    def rotation(self, turn: Floats) -> Floats:
        """Return the rotation (..., 3, 3) from first to camera vectors for (azimuth, elevation, roll) (..., 3), rad."""
        return self.world_rotation(turn) @ _lifted(self.elevation_rad).T

    def world_rotation(self, turn: Floats) -> Floats:
        """Return the rotation (..., 3, 3) from world to camera vectors for turns (..., 3), rad."""
        return gimbal(turn[..., 0], self.elevation_rad + turn[..., 1], turn[..., 2])

    def project(self, points: Floats) -> Floats:
        """Return the pixels (..., 2) of camera-frame points (..., 3); nan at or behind the camera's plane."""
        points = np.asarray(points, dtype=np.float64)
        depth = np.where(points[..., 2:] > 0, points[..., 2:], np.nan)
        return self.principal + points[..., :2] / (depth * self.ifov_rad)

    def scale(self, position: Floats) -> float:
        """Return the scale, px a metre, across the line of sight at a camera-frame point (3,).

        It is the square root of the scale of areas: at an angle t off the axis a pixel spans cos^3 t of the solid
        angle of a pixel at the axis.
        """
        range_m = float(np.linalg.norm(position))
        depth_m = float(position[2])
        return float((range_m / depth_m) ** 1.5 / (range_m * self.ifov_rad))

    def directions(self, pixels: Floats) -> Floats:
        """Return the unit vectors (..., 3) of pixels (..., 2), in the camera frame."""
        pixels = np.asarray(pixels, dtype=np.float64)
        plane = (pixels - self.principal) * self.ifov_rad
        rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)
        return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))

    def place(self, pixels: Floats, range_m: float | Floats) -> Floats:
        """Return the camera-frame points (..., 3) m of pixels (..., 2) at a distance of `range_m`."""
        return np.asarray(self.directions(pixels) * np.asarray(range_m)[..., None])

    def zoomed(self, factor: float) -> Geometry:
        """Return the geometry at `factor` times the focal length."""
        return self if factor == 1 else replace(self, ifov_rad=self.ifov_rad / factor)

    def inside(self, x: float, y: float) -> bool:
        """Return True if (x, y) px lies within the frame's outer edges."""
        return -0.5 <= x <= self.size[0] - 0.5 and -0.5 <= y <= self.size[1] - 0.5


def homography(before: Pose, after: Pose, size: tuple[int, int]) -> Floats:
    """Return the matrix H (3, 3) that maps pixels of distant points from one frame to another.

    (x', y', 1) ~ H (x, y, 1) in homogeneous coordinates; both frames have the `size` (columns, rows).
    H = K' R' R^T K^-1 of cameras that share their centre (R. Hartley, A. Zisserman, "Multiple View Geometry in Computer
    Vision", 2nd ed., 2004, section 8.4.2): the parallax of near points between two places of the camera is not in it.
    """
    turn = _pose_rotation(after) @ _pose_rotation(before).T
    return np.asarray(_intrinsics(after, size) @ turn @ np.linalg.inv(_intrinsics(before, size)))


def _pose_rotation(pose: Pose) -> Floats:
    return gimbal(*np.radians([pose.azimuth_deg, pose.elevation_deg, pose.roll_deg]))


def _intrinsics(pose: Pose, size: tuple[int, int]) -> Floats:
    """Return the matrix K (3, 3) from camera-frame directions to homogeneous pixels."""
    x, y = Geometry(size, pose.ifov_rad).axis_px
    return np.array([[1 / pose.ifov_rad, 0, x], [0, 1 / pose.ifov_rad, y], [0, 0, 1]])
