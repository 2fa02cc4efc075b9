"""All motions of the camera together: where it looks, where it stands and how far it zooms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion.base import Path, Pointing
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class CameraTrajectory:
    """The camera at n frames.

    turns   (n, 3) rad: azimuth (right), elevation (up), roll (clockwise) from the first pointing
    places  (n, 3) m, first camera frame: how far it has moved from where it first stood
    zooms   (n,) how many times longer its focal length is than at first
    """

    geometry: Geometry
    turns: Floats
    places: Floats
    zooms: Floats

    @classmethod
    def of(cls, motions: Sequence[Pointing], frames: Floats, context: SceneContext) -> CameraTrajectory:
        """What the motions make together: turns and ways add up, zooms multiply."""
        frames = np.asarray(frames, dtype=np.float64)
        turns = np.sum([np.zeros((len(frames), 3)), *(motion.turns(frames, context) for motion in motions)], axis=0)
        return cls(context.geometry, turns, standpoints(motions, frames, context), zooms(motions, frames, context))

    def lens(self, index: int) -> Geometry:
        """The geometry of frame `index`, zoomed."""
        return self.geometry.zoomed(float(self.zooms[index]))

    def rotation(self, index: int) -> Floats:
        """(3, 3): first-camera vectors to the vectors of the camera at frame `index`."""
        return _rotation(self.geometry, tuple(self.turns[index].tolist()))

    @cached_property
    def rotations(self) -> Floats:
        """(n, 3, 3): the rotation of each frame, worked out once for all targets; the same to the last bit."""
        return self.geometry.rotation(self.turns)

    def seen(self, points: Floats) -> Floats:
        """(n, 2) px of points (n, 3) m of the first camera frame, each at its own frame; nan behind the camera."""
        pixels = self.geometry.project(np.einsum("nij,nj->ni", self.rotations, points - self.places))
        if (self.zooms == 1).all():
            return pixels
        principal = self.geometry.principal
        return np.asarray(principal + (pixels - principal) * self.zooms[:, None])


@lru_cache(maxsize=8)
def _rotation(geometry: Geometry, turn: tuple[float, ...]) -> Floats:
    """All that a frame holds is seen by one rotation, and by a camera that stands still all frames are."""
    rotation = geometry.rotation(np.array(turn))
    rotation.flags.writeable = False
    return rotation


def standpoints(motions: Sequence[Pointing], frames: Floats, context: SceneContext) -> Floats:
    """(n, 3) m, first camera frame: where the camera is at frame numbers (n,)."""
    frames = np.asarray(frames, dtype=np.float64)
    ways = [motion.shifts(frames, context) for motion in motions]
    return np.asarray(np.sum([np.zeros((len(frames), 3)), *ways], axis=0))


def zooms(motions: Sequence[Pointing], frames: Floats, context: SceneContext) -> Floats:
    """(n,) how many times longer than at first the focal length is at frame numbers (n,)."""
    frames = np.asarray(frames, dtype=np.float64)
    return np.asarray(np.prod([np.ones(len(frames)), *(motion.zooms(frames, context) for motion in motions)], axis=0))


@dataclass(frozen=True, eq=False)
class Company:
    """The Cast of a scenario: the paths of all its targets by name, and the camera's motions that are on."""

    paths: Mapping[str, Path]
    motions: Sequence[Pointing]

    def way(self, name: str, frames: Floats, context: SceneContext) -> Floats:
        return self.paths[name].positions(frames, context, name)

    def standpoints(self, frames: Floats, context: SceneContext) -> Floats:
        return standpoints(self.motions, frames, context)

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        return zooms(self.motions, frames, context)
