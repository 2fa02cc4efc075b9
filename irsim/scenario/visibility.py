"""A scenario looked at target by target: where each is, and how much of it an occluder hides."""

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
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Box, Floats

LOOKED = 3000
"""Frames at which a doubt about an occluder looks."""

MOST_EXTENTS = 16
"""Occluders whose extents are kept at once: where one is placed, many are tried."""

MOST_SPRITES = 256
"""Targets, as they are drawn in frames, that are kept at once of each other instant of an exposure."""

MOST_OF_FRAMES = 16_384
"""Those that are kept at once of the frames' own times: of LOOKED frames all of five targets; of 10^6 frames all would
be some 15 GB."""


@dataclass(frozen=True)
class Watch:
    """A scenario, less what is switched off in it, looked at target by target, `offset` frames after each frame's
    time."""

    scenario: Scenario
    offset: float = 0.0

    @cached_property
    def shown(self) -> Scenario:
        return self.scenario.shown

    @cached_property
    def context(self) -> SceneContext:
        return self.shown.context

    @cached_property
    def mount(self) -> CameraTrajectory:
        return CameraTrajectory.of(
            self.shown.motions, np.arange(float(self.scenario.frames)) + self.offset, self.context
        )

    @cached_property
    def courses(self) -> dict[str, TargetTrajectory]:
        """Of each target that is on, by id."""
        there = (target for target in self.shown.targets if self.shown.is_on(target.id))
        return {target.id: TargetTrajectory.of(target, self.mount, self.context, self.offset) for target in there}

    @cached_property
    def instants(self) -> tuple[Watch, ...]:
        """The same at the instants of which a frame is the mean: what hides, and is hidden, is so over an exposure."""
        offsets = self.shown.camera.exposure_offsets(self.shown.is_on)
        return tuple(self if offset == 0 else Watch(self.scenario, offset) for offset in offsets)

    @cached_property
    def _sprites(self) -> dict[tuple[str, int], Sprite | None]:
        return {}

    def sprite(self, name: str, index: int) -> Sprite | None:
        """Target `name` as it is drawn at frame `index`."""
        key = (name, index)
        if key not in self._sprites:
            if len(self._sprites) == (MOST_SPRITES if self.offset else MOST_OF_FRAMES):
                self._sprites.clear()
            course = self.courses[name]
            view = course.view(index, self.pose(index))
            self._sprites[key] = course.target.shape.draw(view) if course.target.exists(index) else None
        return self._sprites[key]

    def first_m(self, name: str, index: int, target: Sprite) -> float:
        """How far target `name`, as it is drawn at frame `index`, is from the camera's first place, m."""
        away = self.courses[name].first_m(index, self.pose(index))
        return target.range_m if away is None else away

    def pose(self, index: int) -> CameraPose:
        """How the camera of frame `index` sees what stands about it."""
        mount, context = self.mount, self.context
        return CameraPose(
            context, mount.lens(index), mount.rotation(index), mount.places[index], index / context.rate_hz
        )

    def hidden(self, occluder: Occluder, name: str, index: int) -> float:
        """Share 0..1 of target `name` that this occluder alone hides at frame `index`."""
        return self._share(name, index, lambda watch, target: watch._covered(occluder, name, index, target))

    def _share(self, name: str, index: int, of: Callable[[Watch, Sprite], float]) -> float:
        """Share 0..1 of target `name` over the exposure of frame `index`, by its px2 at each instant."""
        drawn = [(watch, target) for watch in self.instants if (target := watch.sprite(name, index)) is not None]
        return sum(of(*each) for each in drawn) / sum(target.area for _, target in drawn) if drawn else 0.0

    def _covered(self, occluder: Occluder, name: str, index: int, target: Sprite) -> float:
        met = self._met(occluder, name, index, target)
        return 0.0 if met is None else float((target.cover[met[0]] * met[1]).sum())

    def hidden_of_shown(self, occluder: Occluder, name: str, index: int) -> float:
        """Share 0..1 that this occluder alone hides of what is in the picture of target `name`; 0 where nothing is."""
        shown = self._share(name, index, lambda _, target: self._shown(target))
        return self.hidden(occluder, name, index) / shown if shown > AREA_ROUNDING else 0.0

    def _shown(self, target: Sprite) -> float:
        """How much of a target is in the picture, hidden or not, px2."""
        columns, rows = self.context.geometry.size
        met = target.within((rows, columns))
        return 0.0 if met is None else float(target.cover[met[0]].sum())

    def hidden_by(self, occluders: Sequence[Occluder], name: str, index: int) -> float:
        """Share 0..1 of target `name` that all of these together hide at frame `index`."""
        return self._share(name, index, lambda watch, target: watch._covered_by(occluders, name, index, target))

    def _covered_by(self, occluders: Sequence[Occluder], name: str, index: int, target: Sprite) -> float:
        left = target.cover.copy()
        for occluder in occluders:
            met = self._met(occluder, name, index, target)
            if met is not None:
                left[met[0]] *= 1 - met[1]
        return float((target.cover - left).sum())

    def _met(
        self, occluder: Occluder, name: str, index: int, target: Sprite
    ) -> tuple[tuple[slice, slice], Floats] | None:
        """Where an occluder lies before target `name`, as it is drawn at frame `index`, and its cover there."""
        if self.first_m(name, index, target) <= occluder.range_m:
            return None
        extent = self._extent(occluder)
        if extent is not None and not self._near(target, extent, occluder.range_m, index):
            return None
        screen = occluder.draw(self.pose(index))
        if screen is None:
            return None
        met = target.meets(screen)
        return None if met is None else (met[0], screen.cover[met[1]])

    @cached_property
    def _extents(self) -> dict[int, tuple[Occluder, Box | None]]:
        """By the occluder's own number, as those of users need not be hashable: it is kept, so that no other has it."""
        return {}

    def _extent(self, occluder: Occluder) -> Box | None:
        """What holds all of an occluder: the same in all frames, and asked for in each."""
        if id(occluder) not in self._extents:
            if len(self._extents) == MOST_EXTENTS:
                self._extents.clear()
            self._extents[id(occluder)] = occluder, occluder.extent(self.context)
        return self._extents[id(occluder)][1]

    def _near(self, target: Sprite, extent: Box, range_m: float, index: int) -> bool:
        """Could something of that extent, px of the unmoved camera, meet the target at frame `index`?"""
        rows, columns = target.cover.shape
        left, top = target.x0 - 0.5, target.y0 - 0.5
        ends = np.array([[left, top], [left + columns, top], [left + columns, top + rows], [left, top + rows]])
        corners = self.at_first(ends, range_m, index)
        if not np.isfinite(corners).all():
            return True
        (left, top), (right, bottom) = corners.min(axis=0) - 1, corners.max(axis=0) + 1
        return bool(left < extent.right and right > extent.left and top < extent.bottom and bottom > extent.top)

    def meets(self, occluder: Occluder, name: str) -> bool:
        """Does it hide some of target `name` in any frame (of long scenarios: of LOOKED evenly spread ones)?"""
        step = math.ceil(self.scenario.frames / LOOKED)
        return any(self.hidden(occluder, name, index) > 0 for index in range(0, self.scenario.frames, step))

    def at_first(self, pixels: Floats, range_m: float, index: int) -> Floats:
        """(n, 2) px of frame `index` as px at which the unmoved camera sees the same places at `range_m`."""
        pose = self.pose(index)
        rays = pose.lens.directions(pixels) @ pose.rotation
        return pose.context.geometry.project(pose.place + rays * _distance(rays, pose.place, range_m))

    def way(self, name: str, range_m: float) -> Floats:
        """(frames, 2) px at which the unmoved camera sees what hides the target's middle from `range_m`."""
        places = self.mount.places
        rays = self.courses[name].positions - places
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        return self.context.geometry.project(places + rays * _distance(rays, places, range_m))


def _distance(rays: Floats, places: Floats, range_m: float) -> Floats:
    """(n, 1) m along unit rays (n, 3) from places (n, 3) or (3,) to the sphere about where the camera first stood."""
    along = np.sum(rays * places, axis=-1, keepdims=True)
    reach = along**2 - np.sum(places**2, axis=-1, keepdims=True) + range_m**2
    return np.asarray(np.sqrt(np.where(reach > 0, reach, np.nan)) - along)
