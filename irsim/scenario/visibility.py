"""Visibility of a scenario's targets: position and silhouette in each frame, and the fraction that occluders hide.

A frame integrates light over an exposure. Fractions are therefore means over the exposure's sample times, weighted by
the target's area at each time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.sprite import AREA_ROUNDING, Sprite
from irsim.motion import CameraTrajectory
from irsim.occluders import Occluder
from irsim.scenario.model import Scenario
from irsim.targets.target import Target
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Box, Floats

MAX_FRAMES = 3000
"""Largest number of frames at which visibility is computed for a warning."""
FEWER_FRAMES = 200
"""Largest number of frames for warnings that need no dense sampling."""

_CACHED_SPRITES = 256
"""Number of cached sprites for each sample time of an exposure other than the frame's own time."""
_CACHED_FRAME_SPRITES = 16_384
"""Number of cached sprites at the frames' own times: MAX_FRAMES of five targets. 10^6 frames would take 15 GB."""


def sampled_frames(frames: int, most: int = FEWER_FRAMES) -> Floats:
    """Return the numbers of all frames, or of `most` evenly spread ones, (n,)."""
    return np.unique(np.linspace(0, frames - 1, min(frames, most)).round())


def frames_present(target: Target, frames: Floats) -> Floats:
    """Return the numbers of those frames in which a target exists, (n,)."""
    return frames[[target.exists(int(frame)) for frame in frames]]


@dataclass(frozen=True)
class TargetVisibility:
    """Visibility of the targets that are switched on, `offset` frames after each frame's time: within its exposure."""

    scenario: Scenario
    offset: float = 0.0

    @cached_property
    def shown(self) -> Scenario:
        return self.scenario.shown

    @cached_property
    def context(self) -> SceneContext:
        return self.shown.context

    @cached_property
    def camera(self) -> CameraTrajectory:
        times = np.arange(float(self.scenario.frames)) + self.offset
        return CameraTrajectory.of(self.shown.motions, times, self.context)

    @cached_property
    def trajectories(self) -> dict[str, TargetTrajectory]:
        """Trajectories of the targets that are switched on, by id."""
        enabled = (target for target in self.shown.targets if self.shown.is_on(target.id))
        return {target.id: TargetTrajectory.of(target, self.camera, self.context, self.offset) for target in enabled}

    @cached_property
    def exposure(self) -> tuple[TargetVisibility, ...]:
        """Visibility at each sample time of the exposure."""
        offsets = self.shown.camera.exposure_offsets(self.shown.is_on)
        return tuple(self if offset == 0 else TargetVisibility(self.scenario, offset) for offset in offsets)

    def pose(self, frame: int) -> CameraPose:
        """Return the pose of the camera in a frame."""
        camera, context = self.camera, self.context
        time_s = frame / context.rate_hz
        return CameraPose(context, camera.lens(frame), camera.rotations[frame], camera.places[frame], time_s)

    def sprite(self, name: str, frame: int) -> Sprite | None:
        """Return target `name` as drawn in a frame; None where it does not exist or covers no pixel."""
        key = (name, frame)
        if key not in self._sprites:
            if len(self._sprites) == (_CACHED_SPRITES if self.offset else _CACHED_FRAME_SPRITES):
                self._sprites.clear()
            trajectory = self.trajectories[name]
            view = trajectory.view(frame, self.pose(frame))
            self._sprites[key] = trajectory.target.shape.draw(view) if trajectory.target.exists(frame) else None
        return self._sprites[key]

    def range_from_origin_m(self, name: str, frame: int, sprite: Sprite) -> float:
        """Return the distance of target `name` from the camera's first position, m."""
        range_m = self.trajectories[name].range_from_origin_m(frame, self.pose(frame))
        return sprite.range_m if range_m is None else range_m

    def occluded(self, occluders: Sequence[Occluder], name: str, frame: int) -> float:
        """Return the fraction 0..1 of target `name` that `occluders` together hide in a frame."""
        return self._fraction(name, frame, lambda at, sprite: at._occluded_px2(occluders, name, frame, sprite))

    def occluded_in_picture(self, occluder: Occluder, name: str, frame: int) -> float:
        """Return the hidden fraction 0..1 of the part of target `name` inside the picture; 0 where it is outside."""
        inside = self._fraction(name, frame, lambda _, sprite: self._inside_px2(sprite))
        return self.occluded([occluder], name, frame) / inside if inside > AREA_ROUNDING else 0.0

    def ever_occludes(self, occluder: Occluder, name: str) -> bool:
        """Return True if an occluder hides any of target `name` in one of at most MAX_FRAMES evenly spread frames."""
        step = math.ceil(self.scenario.frames / MAX_FRAMES)
        return any(self.occluded([occluder], name, frame) > 0 for frame in range(0, self.scenario.frames, step))

    def in_first_view(self, pixels: Floats, range_m: float, frame: int) -> Floats:
        """Return pixels (n, 2) of a frame as pixels of the camera at rest, for points `range_m` from its origin."""
        pose = self.pose(frame)
        rays = pose.lens.directions(pixels) @ pose.rotation
        return pose.context.geometry.project(pose.place + rays * _ray_length(rays, pose.place, range_m))

    def line_of_sight_px(self, name: str, range_m: float) -> Floats:
        """Return the points at which the line of sight to a target reaches the distance `range_m`, (frames, 2) px of
        the camera at rest."""
        places = self.camera.places
        rays = self.trajectories[name].positions - places
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        return self.context.geometry.project(places + rays * _ray_length(rays, places, range_m))

    @cached_property
    def _sprites(self) -> dict[tuple[str, int], Sprite | None]:
        return {}

    @cached_property
    def _extents(self) -> dict[int, tuple[Occluder, Box | None]]:
        """Boxes around occluders by Python's `id()` of the occluder, which may be unhashable. A stored reference to the
        occluder keeps this number unique."""
        return {}

    def _fraction(self, name: str, frame: int, area: Callable[[TargetVisibility, Sprite], float]) -> float:
        """Return the sum of `area` over the sample times, divided by that of the target's whole area: 0..1.

        `area` maps the visibility at a sample time and the target's sprite to an area, px2.
        """
        drawn = [(at, sprite) for at in self.exposure if (sprite := at.sprite(name, frame)) is not None]
        return sum(area(*each) for each in drawn) / sum(sprite.area for _, sprite in drawn) if drawn else 0.0

    def _inside_px2(self, sprite: Sprite) -> float:
        columns, rows = self.context.geometry.size
        overlap = sprite.within((rows, columns))
        return 0.0 if overlap is None else float(sprite.cover[overlap[0]].sum())

    def _occluded_px2(self, occluders: Sequence[Occluder], name: str, frame: int, sprite: Sprite) -> float:
        overlaps = [self._overlap(occluder, name, frame, sprite) for occluder in occluders]
        found = [each for each in overlaps if each is not None]
        if len(found) <= 1:  # no rounding of 1 - cover, as the placement search compares exact fractions
            return sum(float((sprite.cover[region] * cover).sum()) for region, cover in found)
        visible = sprite.cover.copy()
        for region, cover in found:
            visible[region] *= 1 - cover
        return float((sprite.cover - visible).sum())

    def _overlap(
        self, occluder: Occluder, name: str, frame: int, sprite: Sprite
    ) -> tuple[tuple[slice, slice], Floats] | None:
        """Return the region of the sprite that an occluder covers, and the covered fraction 0..1 of its pixels."""
        if self.range_from_origin_m(name, frame, sprite) <= occluder.range_m:
            return None
        extent = self._extent(occluder)
        if extent is not None and not self._may_meet(sprite, extent, occluder.range_m, frame):
            return None
        screen = occluder.draw(self.pose(frame))
        if screen is None:
            return None
        overlap = sprite.meets(screen)
        return None if overlap is None else (overlap[0], screen.cover[overlap[1]])

    def _extent(self, occluder: Occluder) -> Box | None:
        """Return the box around all of an occluder, px of the camera at rest, which is the same in every frame."""
        if id(occluder) not in self._extents:
            self._extents[id(occluder)] = occluder, occluder.extent(self.context)
        return self._extents[id(occluder)][1]

    def _may_meet(self, sprite: Sprite, extent: Box, range_m: float, frame: int) -> bool:
        """Return True if an occluder within the box `extent`, px of the camera at rest, can overlap the sprite."""
        rows, columns = sprite.cover.shape
        left, top = sprite.x0 - 0.5, sprite.y0 - 0.5
        ends = np.array([[left, top], [left + columns, top], [left + columns, top + rows], [left, top + rows]])
        corners = self.in_first_view(ends, range_m, frame)
        if not np.isfinite(corners).all():
            return True
        (left, top), (right, bottom) = corners.min(axis=0) - 1, corners.max(axis=0) + 1
        return bool(left < extent.right and right > extent.left and top < extent.bottom and bottom > extent.top)


def _ray_length(rays: Floats, places: Floats, range_m: float) -> Floats:
    """Return the distance, m, (n, 1), along unit `rays` (n, 3) from `places` (n, 3) or (3,) to the sphere of radius
    `range_m` around the camera's first position; nan where a ray misses the sphere."""
    along = np.sum(rays * places, axis=-1, keepdims=True)
    square = along**2 - np.sum(places**2, axis=-1, keepdims=True) + range_m**2
    return np.asarray(np.sqrt(np.where(square > 0, square, np.nan)) - along)
