"""Base classes of target paths and camera motions, and the dynamics of random paths."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, LiteralString

import numpy as np
from pydantic_core import PydanticCustomError

from irsim.config.base import Kind, NamedKind
from irsim.config.quantities import TOP_SPEED, Degrees, Height, NotNegative, Pair, PixelSpeed, Range, Speed, Triple
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import gimbal
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Linear dynamics x(k+1) = F x(k) + w, w ~ N(0, Q), in one or several modes.

    state        names of the state's components; px and frames, or m and s for paths in metres
    transitions  (modes, d, d) F of each mode
    noises       (modes, d, d) Q of each mode
    switching    (modes, modes) probability of mode j after mode i; rows sum to one
    """

    state: tuple[str, ...]
    transitions: Floats
    noises: Floats
    switching: Floats

    @classmethod
    def single(cls, state: tuple[str, ...], transition: Floats, noise: Floats) -> Dynamics:
        """Return linear dynamics of one mode."""
        return cls(state, transition[None], noise[None], np.ones((1, 1)))


def constant_velocity(axes: tuple[str, ...], step: float = 1.0) -> Dynamics:
    """Return motion at constant velocity without noise over a time `step`; state: each axis and its rate, `v<axis>`."""
    state = tuple(name for axis in axes for name in (axis, f"v{axis}"))
    transition = np.kron(np.eye(len(axes)), np.array([[1.0, step], [0.0, 1.0]]))
    return Dynamics.single(state, transition, np.zeros_like(transition))


HORIZON = 1e-4
"""Sine of the least depression angle at which ground is visible: 100 km away from a height of 10 m."""


def path_error(message: LiteralString, *at: str | int, **values: object) -> PydanticCustomError:
    """Return a validation error at a key, its message filled with `values`."""
    return PydanticCustomError("motion", message, {**values, "at": at} if at else values)


class Path(Kind):
    """Path of a target, in closed form or integrated from frame 0: each position is independent of other frames."""

    @abstractmethod
    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """Return (n, 3) m in the first camera frame at frame numbers (n,), fractional or not.

        `name` is the id of the target and addresses the random stream of the path.
        """

    @property
    def begins(self) -> float:
        """First frame in which the target exists."""
        return -math.inf

    @property
    def level_m(self) -> float | None:
        """Height of the unmoved camera above the level ground of the path, m; None if unknown."""
        return None

    def refers(self) -> Mapping[str, str]:
        """Return the ids of the targets to which it refers, by key."""
        return {}

    def obstacle(self, frames: Floats, context: SceneContext, name: str) -> str | None:
        """Return the reason why the path is infeasible at one of the frame numbers (n,); None if it is feasible."""
        return None

    def dynamics(self, context: SceneContext) -> Dynamics | None:
        """Return transition and noise between frames (docs/moments.md); None unless the path is linear in each mode."""
        return None


class MetrePath(Path):
    """Path in space, in metres."""

    axes: Literal["camera", "world"] = "camera"
    """`camera`: vectors are [right, down, ahead] of the camera at its first pointing; `world`: they are [east, north,
    up] from the camera, where north is level ahead at the first pointing."""

    @property
    def axis_names(self) -> tuple[str, ...]:
        return ("right", "down", "ahead") if self.axes == "camera" else ("east", "north", "up")

    def to_first(self, vectors: Floats, context: SceneContext) -> Floats:
        """Return (..., 3) vectors along `axes` in the first camera frame."""
        return np.asarray(vectors) if self.axes == "camera" else world_to_first(vectors, context)

    def to_world(self, vectors: Floats, context: SceneContext) -> Floats:
        """Return (..., 3) vectors along `axes` as east, north, up."""
        if self.axes == "world":
            return np.asarray(vectors)
        east, down, north = np.moveaxis(np.asarray(vectors) @ gimbal(0.0, context.geometry.elevation_rad, 0.0), -1, 0)
        return np.stack([east, north, -down], axis=-1)


def world_to_first(vectors: Floats, context: SceneContext) -> Floats:
    """Return (..., 3) east, north, up as vectors of the first camera frame."""
    east, north, up = np.moveaxis(np.asarray(vectors, dtype=np.float64), -1, 0)
    return np.asarray(np.stack([east, -up, north], axis=-1) @ gimbal(0.0, context.geometry.elevation_rad, 0.0).T)


class PixelPath(Path):
    """Path in pixels of the unmoved camera, which are directions, with a range that changes at a constant rate.

    The unmoved camera is the camera at its first position and pointing, with a zoom of 1. A target at a negative range
    is behind it.
    """

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"ground_m": ("range_m", "closing_m_s")}

    range_m: Range = 1000.0
    """Range at frame 0, m."""
    closing_m_s: Speed = 0.0
    """Closing speed along the line of sight, m/s."""
    ground_m: Height | None = None
    """Height of the camera above level ground on which the target moves, m. The range then follows from the direction,
    and `range_m` and `closing_m_s` are ignored. Default: `range_m` and `closing_m_s` give the range."""

    @property
    def level_m(self) -> float | None:
        return self.ground_m

    @abstractmethod
    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """Return (n, 2) px of the unmoved camera at frame numbers (n,), fractional or not."""

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
        """Return the sine of the depression angle of pixels (n, 2), (n,)."""
        return np.asarray(context.geometry.directions(pixels) @ context.geometry.down)


class HeadedPixelPath(PixelPath):
    """Path in pixels with a start, a speed and a heading."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """Speed, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction at frame 0, degrees: 0 right, 90 down."""


def unit(heading_deg: float) -> Floats:
    """Return the unit vector (2,) of a heading in the picture: 0 right, 90 down."""
    heading = np.radians(heading_deg)
    return np.array([np.cos(heading), np.sin(heading)])


class CameraMotion(NamedKind):
    """Rotation or translation of the camera, or change of its focal length; several motions are combined by
    `CameraTrajectory.of`.

    Every method takes frame numbers (n,), fractional or not.
    """

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        """Return rotations (n, 3), rad: azimuth (right), elevation (up), roll (clockwise)."""
        return np.zeros((len(frames), 3))

    def shifts(self, frames: Floats, context: SceneContext) -> Floats:
        """Return the displacement of the camera from its first position, (n, 3) m, first camera frame."""
        return np.zeros((len(frames), 3))

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        """Return the factor on the focal length, (n,)."""
        return np.ones(len(frames))

    def refers(self) -> Mapping[str, str]:
        """Return the ids of the targets to which it refers, by key."""
        return {}


class HeadedPath(MetrePath):
    """Path given by its displacement ahead along a compass heading, to the right of it, and up."""

    start_m: Triple
    """Position at frame 0, m."""
    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 200.0
    """Ground speed, m/s."""
    heading_deg: Degrees = 90.0
    """Direction at frame 0, degrees: 0 level away along the first pointing (north), 90 to the right (east)."""
    climb_m_s: Speed = 0.0
    """Climb rate, m/s."""

    def climb(self, frames: Floats, context: SceneContext) -> Floats:
        """Return the height gained since frame 0, (n,) m."""
        return np.asarray(self.climb_m_s * np.asarray(frames) / context.rate_hz)

    def displaced(self, ahead: Floats, right: Floats, up: Floats, context: SceneContext) -> Floats:
        """Return positions (n, 3) m, first camera frame, of displacements (n,) m from the start."""
        return self.to_first(np.array(self.start_m), context) + offsets_along_heading(
            ahead, right, up, self.heading_deg, context
        )


def offsets_along_heading(
    ahead: Floats, right: Floats, up: Floats, heading_deg: float, context: SceneContext
) -> Floats:
    """Return (n, 3) vectors, first camera frame, of displacements ahead, right and up, (n,) each."""
    heading = math.radians(heading_deg)
    east = ahead * math.sin(heading) + right * math.cos(heading)
    north = ahead * math.cos(heading) - right * math.sin(heading)
    return world_to_first(np.stack([east, north, up], axis=-1), context)


def frames_of(seconds: float, context: SceneContext) -> float:
    """Return a duration in frames, at least 1, as random draws and turn rates are constant within a frame."""
    return max(seconds * context.rate_hz, 1.0)
