"""What a path and a camera motion are."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np

from irsim.config.base import Kind, NamedKind
from irsim.config.quantities import Height, Range, Speed
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import gimbal
from irsim.motion.dynamics import Dynamics
from irsim.types import Floats

HORIZON = 1e-4
"""Sine of the least angle below the level at which ground is seen: 100 km away from 10 m up."""


class Path(Kind):
    """Where a target is. Subclasses have a closed form, or integrate from frame 0 onward, so that a
    position never depends on how many frames are asked for."""

    @abstractmethod
    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """(n, 3) m in the first camera frame, at frame numbers (n,) that may be fractional.

        `name` is the target's id: it addresses the path's randomness.
        """

    @property
    def begins(self) -> float:
        """The first frame at which there is something on this path."""
        return -math.inf

    @property
    def level_m(self) -> float | None:
        """How far the level ground that it goes on lies below the unmoved camera, m; None where it does not say."""
        return None

    def refers(self) -> Mapping[str, str]:
        """Ids of the targets whose paths it asks for, by the key that names each."""
        return {}

    def obstacle(self, frames: Floats, context: SceneContext, name: str) -> str | None:
        """What makes the path impossible at one of the frame numbers (n,); None where nothing does."""
        return None

    def dynamics(self, context: SceneContext) -> Dynamics | None:
        """Transition and noise from frame to frame, for filters and for bounds over several frames (docs/moments.md);
        None where the path is scripted, or linear in no mode."""
        return None


class MetrePath(Path):
    """A path drawn in space."""

    axes: Literal["camera", "world"] = "camera"
    """camera: triples are [right, down, ahead] of the camera at its first pointing; world: [east, north,
    up] of where it stands, north being level ahead at the first pointing."""

    @property
    def axis_names(self) -> tuple[str, ...]:
        return ("right", "down", "ahead") if self.axes == "camera" else ("east", "north", "up")

    def to_first(self, vectors: Floats, context: SceneContext) -> Floats:
        """(..., 3) vectors along `axes` in the first camera frame."""
        return np.asarray(vectors) if self.axes == "camera" else world_to_first(vectors, context)

    def to_world(self, vectors: Floats, context: SceneContext) -> Floats:
        """(..., 3) vectors along `axes` as east, north, up."""
        if self.axes == "world":
            return np.asarray(vectors)
        east, down, north = np.moveaxis(np.asarray(vectors) @ gimbal(0.0, context.geometry.elevation_rad, 0.0), -1, 0)
        return np.stack([east, north, -down], axis=-1)


def world_to_first(vectors: Floats, context: SceneContext) -> Floats:
    """(..., 3) east, north, up as vectors of the first camera frame."""
    east, north, up = np.moveaxis(np.asarray(vectors, dtype=np.float64), -1, 0)
    return np.asarray(np.stack([east, -up, north], axis=-1) @ gimbal(0.0, context.geometry.elevation_rad, 0.0).T)


class PixelPath(Path):
    """A path drawn in the picture of the unmoved camera, and a range that changes evenly.

    A pixel stands for a direction: a camera that turns sees the target move. A range that has
    closed below zero is behind the camera.
    """

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"ground_m": ("range_m", "closing_m_s")}

    range_m: Range = 1000.0
    """Metres from the camera at frame 0."""
    closing_m_s: Speed = 0.0
    """How fast the range shrinks, metres a second."""
    ground_m: Height | None = None
    """For a target on level ground: how far the ground lies below the camera, metres. The range then
    follows from the direction, and range_m and closing_m_s do not count."""

    @property
    def level_m(self) -> float | None:
        return self.ground_m

    @abstractmethod
    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """(n, 2) px as the unmoved camera sees them, at frame numbers (n,) that may be fractional."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        pixels = self.pixels(frames, context, name)
        if self.ground_m is None:
            return context.geometry.place(pixels, self.range_m - self.closing_m_s * frames / context.rate_hz)
        descent = self._descent(pixels, context)
        return context.geometry.place(pixels, self.ground_m / np.maximum(descent, HORIZON))

    def obstacle(self, frames: Floats, context: SceneContext, name: str) -> str | None:
        if self.ground_m is None:
            return None
        pixels = self.pixels(np.asarray(frames, dtype=np.float64), context, name)
        descent = self._descent(pixels, context)
        if descent.min() >= HORIZON:
            return None
        x, y = pixels[np.argmax(descent < HORIZON)]
        return f"at ({x:.0f}, {y:.0f}) px it is above the horizon; allowed with ground_m: a path below the horizon"

    @staticmethod
    def _descent(pixels: Floats, context: SceneContext) -> Floats:
        """(n,): sine of the angle by which the directions of pixels (n, 2) look down."""
        return np.asarray(context.geometry.directions(pixels) @ context.geometry.down)


class Pointing(NamedKind):
    """A motion of the camera: it turns it, carries it, or changes its focal length.

    The motions of a list add up. Each of the methods says how much at frame numbers (n,), which may
    be fractional.
    """

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        """(n, 3) rad at frame numbers (n,): azimuth (right), elevation (up), roll (clockwise)."""
        return np.zeros((len(frames), 3))

    def shifts(self, frames: Floats, context: SceneContext) -> Floats:
        """(n, 3) m, first camera frame: how far it has carried the camera from where it first stood."""
        return np.zeros((len(frames), 3))

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        """(n,) how many times longer it makes the focal length."""
        return np.ones(len(frames))

    def refers(self) -> Mapping[str, str]:
        """Ids of the targets whose paths it asks for, by the key that names each."""
        return {}
