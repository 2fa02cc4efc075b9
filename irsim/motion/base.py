"""What a path and a camera motion are."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from irsim.errors import InputError
from irsim.kinds import Kind, NamedKind, Positive
from irsim.stage import Stage
from irsim.types import Floats


class Path(Kind):
    """Where a target is. Subclasses have a closed form, or integrate from frame 0 onward, so that a
    position never depends on how many frames are asked for."""

    @abstractmethod
    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        """(n, 3) m in the first camera frame, at frame numbers (n,) that may be fractional.

        `name` is the target's id: it addresses the path's randomness.
        """


class PixelPath(Path):
    """A path drawn in the picture of the unmoved camera, and a range that changes evenly.

    A pixel stands for a direction: a camera that turns sees the target move. A range that has
    closed below zero is behind the camera.
    """

    range_m: Positive = 1000.0
    """Metres from the camera at frame 0."""
    closing_m_s: float = 0.0
    """How fast the range shrinks, metres a second."""
    ground_m: Positive | None = None
    """For a target on level ground: how far the ground lies below the camera, metres. The range then
    follows from the direction, and range_m and closing_m_s do not count."""

    @abstractmethod
    def pixels(self, frames: Floats, stage: Stage, name: str) -> Floats:
        """(n, 2) px as the unmoved camera sees them, at frame numbers (n,) that may be fractional."""

    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        pixels = self.pixels(frames, stage, name)
        if self.ground_m is None:
            return stage.geometry.place(pixels, self.range_m - self.closing_m_s * frames / stage.rate_hz)
        descent = stage.geometry.directions(pixels) @ stage.geometry.down
        if descent.min() <= 0:
            x, y = pixels[np.argmin(descent)]
            raise InputError(
                f"targets.{name}.path: ({x:.0f}, {y:.0f}) px lies above the horizon, where there is no ground; "
                "allowed with ground_m: a path below the horizon"
            )
        return stage.geometry.place(pixels, self.ground_m / descent)


class Pointing(NamedKind):
    """A motion of the camera; the motions of a list add up."""

    @abstractmethod
    def turns(self, frames: Floats, stage: Stage) -> Floats:
        """(n, 3) rad at frame numbers (n,): azimuth (right), elevation (up), roll (clockwise)."""
