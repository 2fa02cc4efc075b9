"""Where things are seen: directions, pixels, and the camera's turning.

Frames of reference (right-handed, metres):
    camera   x right, y down, z along the optical axis
    first    the camera frame at the first pointing, before any motion: paths in metres live here
    world    x east (right of the first azimuth), y down, z level ahead at the first azimuth; it
             differs from `first` by the first elevation only
A pinhole: the pixel of a camera-frame point is principal + (x/z, y/z)/ifov, so IFOV holds at the
axis; the principal point is the middle of the frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from irsim.types import Floats


def gimbal(azimuth: float | Floats, elevation: float | Floats, roll: float | Floats) -> Floats:
    """(..., 3, 3): world vectors to camera vectors. Radians (...), right, up and clockwise positive.

    Azimuth turns about the world's vertical, elevation about the level axis, roll about the
    optical axis.
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
    """The gimbal of the first pointing, kept: every frame's rotation asks for it."""
    rotation = gimbal(0.0, elevation, 0.0)
    rotation.setflags(write=False)
    return rotation


@dataclass(frozen=True)
class Geometry:
    """What fixes where a direction falls in the picture.

    size (columns, rows); ifov_rad, radians a pixel at the axis; elevation_rad of the first pointing;
    shift_px (right, down) by which the optical axis falls beside the middle of the frame.
    """

    size: tuple[int, int]
    ifov_rad: float
    elevation_rad: float = 0.0
    shift_px: tuple[float, float] = (0.0, 0.0)

    @property
    def principal(self) -> Floats:
        """(2,) px: where the optical axis falls."""
        return np.array(self.axis_px)

    @property
    def axis_px(self) -> tuple[float, float]:
        """The same as numbers (x, y)."""
        return (self.size[0] - 1) / 2 + self.shift_px[0], (self.size[1] - 1) / 2 + self.shift_px[1]

    @property
    def down(self) -> Floats:
        """(3,): the world's downward direction in the first camera frame."""
        return np.asarray(gimbal(0.0, self.elevation_rad, 0.0) @ [0.0, 1.0, 0.0])

    def rotation(self, turn: Floats) -> Floats:
        """(..., 3, 3): first-camera vectors to those of a camera turned by (..., 3) azimuth, elevation, roll, rad."""
        return self.world_rotation(turn) @ _lifted(self.elevation_rad).T

    def world_rotation(self, turn: Floats) -> Floats:
        """(..., 3, 3): world vectors to the vectors of the camera turned by (..., 3) rad."""
        return gimbal(turn[..., 0], self.elevation_rad + turn[..., 1], turn[..., 2])

    def project(self, points: Floats) -> Floats:
        """(..., 3) camera-frame points to (..., 2) px; nan at or behind the camera's plane."""
        points = np.asarray(points, dtype=np.float64)
        depth = np.where(points[..., 2:] > 0, points[..., 2:], np.nan)
        return self.principal + points[..., :2] / (depth * self.ifov_rad)

    def scale(self, position: Floats) -> float:
        """Pixels a metre, of what lies across the line of sight at a camera-frame point (3,) before the camera.

        The square root of that of areas: t off the axis a pixel sees cos^3 t of the solid angle that it sees there.
        """
        range_m = float(np.linalg.norm(position))
        depth_m = float(position[2])
        return float((range_m / depth_m) ** 1.5 / (range_m * self.ifov_rad))

    def directions(self, pixels: Floats) -> Floats:
        """(..., 2) px to (..., 3) unit vectors in the camera frame."""
        pixels = np.asarray(pixels, dtype=np.float64)
        plane = (pixels - self.principal) * self.ifov_rad
        rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)
        return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))

    def place(self, pixels: Floats, range_m: float | Floats) -> Floats:
        """(..., 3) m: the points at that range in the directions of (..., 2) px."""
        return np.asarray(self.directions(pixels) * np.asarray(range_m)[..., None])

    def zoomed(self, factor: float) -> Geometry:
        """The same camera with a focal length `factor` times as long."""
        return self if factor == 1 else replace(self, ifov_rad=self.ifov_rad / factor)

    def inside(self, x: float, y: float) -> bool:
        """Is (x, y) px within the frame's edges?"""
        return -0.5 <= x <= self.size[0] - 0.5 and -0.5 <= y <= self.size[1] - 0.5
