"""Trajectory of the camera: the sum of its motions as rotation, position and zoom of each frame."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion.base import CameraMotion, Path
from irsim.types import Floats, Pose


@dataclass(frozen=True, eq=False)
class CameraTrajectory:
    """Pose of the camera at n frames.

    turns   (n, 3) rad: azimuth (right), elevation (up), roll (clockwise) from the first pointing
    places  (n, 3) m, first camera frame: displacement from the first position
    zooms   (n,) focal length over the focal length at zoom 1
    """

    geometry: Geometry
    turns: Floats
    places: Floats
    zooms: Floats

    @classmethod
    def of(cls, motions: Sequence[CameraMotion], frames: Floats, context: SceneContext) -> CameraTrajectory:
        """Return the sum of motions: rotations and translations add, zooms multiply."""
        frames = np.asarray(frames, dtype=np.float64)
        turns = np.sum([np.zeros((len(frames), 3)), *(motion.turns(frames, context) for motion in motions)], axis=0)
        return cls(context.geometry, turns, camera_positions(motions, frames, context), zooms(motions, frames, context))

    def lens(self, index: int) -> Geometry:
        """Return the geometry of frame `index` with its zoom."""
        return self.geometry.zoomed(float(self.zooms[index]))

    def pose(self, index: int) -> Pose:
        """Return pose and focal length of frame `index`, as the ground truth holds them."""
        azimuth, elevation, roll = self.turns[index].tolist()
        east, down, north = (self.places[index] @ self.geometry.world_rotation(np.zeros(3))).tolist()
        return Pose(
            azimuth_deg=math.degrees(azimuth),
            elevation_deg=math.degrees(self.geometry.elevation_rad + elevation),
            roll_deg=math.degrees(roll),
            ifov_rad=self.lens(index).ifov_rad,
            place_m=(east, north, 0.0 - down),
        )

    @cached_property
    def rotations(self) -> Floats:
        """Rotations from the first camera frame to that of each frame, (n, 3, 3)."""
        return self.geometry.rotation(self.turns)

    def project(self, points: Floats) -> Floats:
        """Return (n, 2) px of points (n, 3) m of the first camera frame, each at its own frame; nan behind the
        camera."""
        pixels = self.geometry.project(np.einsum("nij,nj->ni", self.rotations, points - self.places))
        if (self.zooms == 1).all():
            return pixels
        principal = self.geometry.principal
        return np.asarray(principal + (pixels - principal) * self.zooms[:, None])


def camera_positions(motions: Sequence[CameraMotion], frames: Floats, context: SceneContext) -> Floats:
    """Return the positions of the camera, (n, 3) m, first camera frame, at frame numbers (n,)."""
    frames = np.asarray(frames, dtype=np.float64)
    ways = [motion.shifts(frames, context) for motion in motions]
    return np.asarray(np.sum([np.zeros((len(frames), 3)), *ways], axis=0))


def zooms(motions: Sequence[CameraMotion], frames: Floats, context: SceneContext) -> Floats:
    """Return the focal length over the focal length at zoom 1, (n,), at frame numbers (n,)."""
    frames = np.asarray(frames, dtype=np.float64)
    return np.asarray(np.prod([np.ones(len(frames)), *(motion.zooms(frames, context) for motion in motions)], axis=0))


@dataclass(frozen=True, eq=False)
class SceneMotion:
    """`SceneObjects` of a scenario: the paths of its targets by id, and the active camera motions."""

    paths: Mapping[str, Path]
    motions: Sequence[CameraMotion]

    def target_positions(self, name: str, frames: Floats, context: SceneContext) -> Floats:
        return self.paths[name].positions(frames, context, name)

    def camera_positions(self, frames: Floats, context: SceneContext) -> Floats:
        return camera_positions(self.motions, frames, context)

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        return zooms(self.motions, frames, context)
