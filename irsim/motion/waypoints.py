"""Paths through points: a cubic spline, at given frames or at constant speed."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Several
from irsim.config.quantities import TOP_PIXEL_SPEED, TOP_SPEED, Number, Pair, Positive, Triple
from irsim.geometry.context import SceneContext
from irsim.motion.base import MetrePath, PixelPath
from irsim.motion.spline import Spline
from irsim.types import Floats


def _check(points: tuple[tuple[float, ...], ...], frames: tuple[float, ...] | None, speed: float | None) -> None:
    """The rules that the two kinds share; PydanticCustomError with the key at fault."""
    if frames is None and speed is None:
        raise PydanticCustomError("waypoints", "neither 'frames' nor a speed is given; allowed: one of them", {})
    if frames is not None and speed is not None:
        raise PydanticCustomError(
            "waypoints", "'frames' and a speed exclude each other; allowed: one of them", {"at": ("frames",)}
        )
    if frames is not None and len(frames) != len(points):
        raise PydanticCustomError(
            "waypoints",
            "frames: {frames}, points: {points}; allowed: one frame for each point",
            {"frames": len(frames), "points": len(points), "at": ("frames",)},
        )
    if frames is not None and any(b <= a for a, b in pairwise(frames)):
        raise PydanticCustomError("waypoints", "the frames do not rise; allowed: rising frames", {"at": ("frames",)})
    if speed is not None and any(a == b for a, b in pairwise(points)):
        raise PydanticCustomError(
            "waypoints", "a point stands twice in a row; allowed with a speed: points that differ", {"at": ("points",)}
        )


def _along(points: tuple[tuple[float, ...], ...], at: tuple[float, ...] | None, speed: float, frames: Floats) -> Floats:
    """(n, d) places at frame numbers (n,): through `points` at frames `at`, or at `speed` units per frame."""
    places = np.array(points)
    frames = np.asarray(frames, dtype=np.float64)
    if at is not None:
        return Spline(np.array(at), places).at(frames)
    chords = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return Spline(np.append(0.0, np.cumsum(chords)), places).at_distance(speed * frames)


class Waypoints(PixelPath):
    """A smooth curve through points of the picture, straight on before the first and past the last."""

    points: Annotated[Several[Pair], Field(min_length=2)]
    """List of [x, y], px."""
    frames: Several[Number] | None = None
    """Frame at which each point is passed; or give `speed`."""
    speed: Annotated[Positive, TOP_PIXEL_SPEED] | None = None
    """Constant speed along the curve from the first point at frame 0, px per frame; or give `frames`."""

    @model_validator(mode="after")
    def _one_pace(self) -> Waypoints:
        _check(self.points, self.frames, self.speed)
        return self

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        return _along(self.points, self.frames, self.speed or 0.0, frames)


class WaypointsM(MetrePath):
    """A smooth curve through points in space, straight on before the first and past the last."""

    points: Annotated[Several[Triple], Field(min_length=2)]
    """List of places, m."""
    frames: Several[Number] | None = None
    """Frame at which each point is passed; or give `speed_m_s`."""
    speed_m_s: Annotated[Positive, TOP_SPEED] | None = None
    """Constant speed along the curve from the first point at frame 0, metres a second; or give `frames`."""

    @model_validator(mode="after")
    def _one_pace(self) -> WaypointsM:
        _check(self.points, self.frames, self.speed_m_s)
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        places = _along(self.points, self.frames, (self.speed_m_s or 0.0) / context.rate_hz, frames)
        return self.to_first(places, context)
