"""Mean path of a manoeuvring target: constant velocity from one frame on, in pixels or in metres as its path.

Where mean path and path agree but for rounding, the positions are those of the path, bit for bit. The classes are no
kinds of the key `path`: `irsim.Twins` makes them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from irsim.config.quantities import Pair, Triple
from irsim.geometry.context import SceneContext
from irsim.motion.base import Path, PixelPath
from irsim.types import Floats

SAME_PX, SAME = 1e-6, 1e-9
"""Distance between a path and its mean path up to which both are equal, px, and as a share of the range: rounding."""


class MeanPath(Path):
    """Another path up to frame `frame`, then constant velocity in space."""

    of: Path
    """Path that it straightens."""
    frame: float
    """Frame at which constant velocity begins."""
    start: Triple
    """Position at `frame`, m, first camera frame."""
    velocity: Triple
    """Velocity, m per frame, first camera frame."""

    @property
    def begins(self) -> float:
        return self.of.begins

    @property
    def level_m(self) -> float | None:
        return self.of.level_m

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        own = self.of.positions(frames, context, name)
        return _straightened(own, np.asarray(frames), self, SAME * np.linalg.norm(own, axis=1))


class MeanPixelPath(PixelPath):
    """Another path up to frame `frame`, then constant velocity in the picture of the unmoved camera."""

    of: PixelPath
    """Path that it straightens."""
    frame: float
    """Frame at which constant velocity begins."""
    start: Pair
    """Position at `frame`, px."""
    velocity: Pair
    """Velocity, px per frame."""

    @property
    def begins(self) -> float:
        return self.of.begins

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        own = self.of.pixels(frames, context, name)
        return _straightened(own, np.asarray(frames), self, np.full(len(own), SAME_PX))


def _straightened(own: Floats, frames: Floats, path: MeanPath | MeanPixelPath, same: Floats) -> Floats:
    """Return positions (n, d) of the mean path, those of the path, `own`, where both are nearer than `same` (n,)."""
    mean = np.asarray(path.start) + (frames - path.frame)[:, None] * np.asarray(path.velocity)
    keeps = (np.linalg.norm(mean - own, axis=1) <= same) | (frames <= path.frame)
    return np.where(keeps[:, None], own, mean)


def straightened(path: Path, frame: int, last: int, context: SceneContext, name: str, ends: bool) -> Path:
    """Return the mean path from frame `frame` on, with the velocity of the path at that frame.

    ends   True: with the mean velocity up to frame `last`, so that the position there is kept
    """
    frames = np.array([frame, last if ends else frame + 1], dtype=np.float64)
    if isinstance(path, PixelPath) and type(path).positions is PixelPath.positions:
        places = path.pixels(frames, context, name)
        ranges = {key: getattr(path, key) for key in PixelPath.model_fields}
        return MeanPixelPath(of=path, frame=float(frame), **_line(places, frames), **ranges)
    return MeanPath(of=path, frame=float(frame), **_line(path.positions(frames, context, name), frames))


def _line(places: Floats, frames: Floats) -> dict[str, Any]:
    """Return start and velocity of the line through two positions (2, d)."""
    velocity = (places[1] - places[0]) / max(frames[1] - frames[0], 1.0)
    return {"start": tuple(places[0].tolist()), "velocity": tuple(velocity.tolist())}
