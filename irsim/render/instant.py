"""Everything that moves in a scenario, at one moment of every frame's exposure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from irsim.backgrounds import ViewDirection
from irsim.backgrounds.base import Place
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.texture import BLOCK, MARGIN
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.motion import CameraTrajectory
from irsim.scenario.model import Scenario
from irsim.targets import View, draw_all
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Floats

Shifts = Mapping[str, tuple[float, float]]
"""Targets that are drawn elsewhere than they are, by (dx, dy) px."""


@dataclass(frozen=True, eq=False)
class Instant:
    """Courses of the targets that are on and the camera's mount, `offset` frames after each frame's time."""

    context: SceneContext
    mount: CameraTrajectory
    courses: tuple[TargetTrajectory, ...]

    @classmethod
    def of(cls, scenario: Scenario, context: SceneContext, offset: float = 0.0) -> Instant:
        count = scenario.frames + 1  # one more: frame 0 takes its velocity from frame 1
        frames = np.arange(float(count)) + offset
        tilt = context.air.turbulence.tilt_angles(frames, context.band, context.rate_hz, context.seed)
        still = CameraTrajectory.of(scenario.motions, frames, context)
        mount = replace(still, turns=still.turns + tilt)
        there = (target for target in scenario.targets if scenario.is_on(target.id))
        return cls(context, mount, tuple(TargetTrajectory.of(target, mount, context, offset) for target in there))

    @cached_property
    def _level(self) -> Floats:
        """(3, 3): world vectors to the vectors of the first camera frame."""
        return self.context.geometry.world_rotation(np.zeros(3))

    def view_direction(self, index: int) -> ViewDirection:
        """A frame's pointing, with that of its block's first frame as key."""
        return self._pointing(index, 0, self._key(index // BLOCK * BLOCK))

    @cached_property
    def _key(self) -> Callable[[int], ViewDirection]:
        """The pointing of a block's first frame."""
        return lru_cache(maxsize=2)(lambda first: self._pointing(first, MARGIN, None))

    def _pointing(self, frame: int, margin: int, key: ViewDirection | None) -> ViewDirection:
        mount = self.mount
        turns, place = tuple(mount.turns[frame].tolist()), tuple(mount.places[frame].tolist())
        chart, in_world = self._outlook(turns, place, float(mount.zooms[frame]), margin)
        return ViewDirection(frame / self.context.rate_hz, chart, key, in_world)

    @cached_property
    def _outlook(self) -> Callable[[tuple[float, ...], tuple[float, ...], float, int], tuple[Chart, Place]]:
        """The chart with a margin of a camera by its turns, place and zoom, and its place in the world: the last ones
        are kept, as a camera that stands still has the same in all frames."""
        geometry, level = self.context.geometry, self._level

        def outlook(
            turns: tuple[float, ...], place: tuple[float, ...], zoom: float, margin: int
        ) -> tuple[Chart, Place]:
            right, down, ahead = (np.array(place) @ level).tolist()
            return _chart(geometry, turns, margin, geometry.zoomed(zoom)), (right, down, ahead)

        return lru_cache(maxsize=4)(outlook)

    @cached_property
    def pose(self) -> Callable[[int], CameraPose]:
        """How the camera of a frame sees what stands about it: the last ones are kept."""
        mount, context = self.mount, self.context

        def seeing(index: int) -> CameraPose:
            return CameraPose(
                context, mount.lens(index), mount.rotation(index), mount.places[index], index / context.rate_hz
            )

        return lru_cache(maxsize=2)(seeing)

    def sprites(self, index: int, numbers: Sequence[int], shifts: Shifts) -> list[Sprite | None]:
        """The targets of those numbers, each alone, at frame `index`."""
        views, pose = [], self.pose(index)
        for number in numbers:
            course = self.courses[number]
            view, shift = course.view(index, pose), shifts.get(course.target.id)
            views.append((course.target.shape, view if shift is None else _moved(view, shift)))
        return draw_all(views)

    def looks_as(self, other: Instant, index: int) -> bool:
        """Does the camera look from the same place in the same way as in another instant of frame `index`?"""
        return other is self or all(
            np.array_equal(getattr(self.mount, what)[index], getattr(other.mount, what)[index])
            for what in ("turns", "places", "zooms")
        )


@lru_cache(maxsize=8)
def _chart(geometry: Geometry, turns: tuple[float, ...], margin: int, lens: Geometry) -> Chart:
    """The chart of a camera turned so; one that stands still has the same in all frames, and what is kept for it."""
    return Chart.at(geometry, geometry.world_rotation(np.array(turns)), margin, lens)


def _moved(view: View, shift: tuple[float, float]) -> View:
    """The view of a target that is moved in the picture, its aspect the same to the last bit."""
    context = view.context
    return view._replace(context=replace(context, geometry=replace(context.geometry, shift_px=shift)))
