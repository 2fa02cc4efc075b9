"""Camera, targets and atmosphere at the instants of each frame's exposure, and prefetch of sprites."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from irsim.backgrounds import ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.texture import BLOCK, MARGIN
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.motion import CameraTrajectory, angles_deg
from irsim.render.composite import NamedSprite
from irsim.scenario.model import Scenario
from irsim.targets import View
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Floats

Shifts = Mapping[str, tuple[float, float]]
"""Displacements (dx, dy), px, of targets in the picture, by id of the target."""

PREFETCHED = 8
"""Largest number of frames whose sprites are drawn together. The processor's caches keep the data of sprites, which
composing a whole picture would evict: drawing sprites frame by frame makes a frame 4 % (full chain) to 16 % slower."""

PREFETCHED_PX = 1 << 16
"""Largest number of pixels of prefetched sprites: 1.5 MB."""


FIRST_FRAMES = 4096
"""Number of frames for which trajectories are computed at first."""


@dataclass(frozen=True, eq=False)
class Instant:
    """Trajectories of camera and targets at a fixed offset, in frames, from the time of each frame."""

    context: SceneContext
    camera: CameraTrajectory
    trajectories: tuple[TargetTrajectory, ...]

    @classmethod
    def of(cls, scenario: Scenario, context: SceneContext, offset: float = 0.0, count: int | None = None) -> Instant:
        """Return the trajectories of the camera, tilted by turbulence, and of the targets that are switched on, in the
        first `count` frames; None: all of them."""
        count = scenario.frames if count is None else count
        frames = np.arange(count + 1.0) + offset  # one more: frame 0 takes its velocity from frame 1
        tilt = context.air.turbulence.tilt_angles(frames, context.band, context.rate_hz, context.seed)
        steady = CameraTrajectory.of(scenario.motions, frames, context)
        camera = replace(steady, turns=steady.turns + tilt)
        targets = (target for target in scenario.targets if scenario.is_on(target.id))
        return cls(context, camera, tuple(TargetTrajectory.of(target, camera, context, offset) for target in targets))

    def view_direction(self, index: int) -> ViewDirection:
        """Return the view direction of a frame. Its key is that of the first frame of the frame's block."""
        return self._view_direction(index, 0, self._key(index // BLOCK * BLOCK))

    @cached_property
    def _key(self) -> Callable[[int], ViewDirection]:
        return lru_cache(maxsize=2)(lambda first: self._view_direction(first, MARGIN, None))

    def _view_direction(self, frame: int, margin: int, key: ViewDirection | None) -> ViewDirection:
        geometry, camera = self.context.geometry, self.camera
        chart = _chart(geometry, tuple(camera.turns[frame].tolist()), margin, camera.lens(frame))
        right, down, ahead = (camera.places[frame] @ self._level).tolist()
        return ViewDirection(frame / self.context.rate_hz, chart, key, (right, down, ahead))

    @cached_property
    def _level(self) -> Floats:
        """Rotation (3, 3) from the world to the first camera frame."""
        return self.context.geometry.world_rotation(np.zeros(3))

    @cached_property
    def pose(self) -> Callable[[int], CameraPose]:
        """Function that returns the camera's pose in a frame; it caches the last two."""
        camera, context = self.camera, self.context

        def pose(index: int) -> CameraPose:
            time_s = index / context.rate_hz
            return CameraPose(context, camera.lens(index), camera.rotations[index], camera.places[index], time_s)

        return lru_cache(maxsize=2)(pose)

    def sprites(self, index: int, numbers: Sequence[int], shifts: Shifts) -> list[Sprite | None]:
        """Return the sprites at frame `index` of the targets with the indices `numbers`, each drawn alone."""
        views, pose = [], self.pose(index)
        for number in numbers:
            trajectory = self.trajectories[number]
            view, shift = trajectory.view(index, pose), shifts.get(trajectory.target.id)
            views.append((trajectory.target.shape, view if shift is None else _shifted(view, shift)))
        return [shape.draw(view) for shape, view in views]

    def has_same_pose(self, other: Instant, index: int) -> bool:
        """Return True if the camera has the same position, rotation and zoom in frame `index` as at another instant."""
        return other is self or all(
            np.array_equal(getattr(self.camera, what)[index], getattr(other.camera, what)[index])
            for what in ("turns", "places", "zooms")
        )


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Trajectories of camera and targets in the first `frames` frames of a scenario.

    now       at the times of the frames;  exposure  at each instant of the exposures
    motions   (targets, frames, 5) velocity (vx, vy), px per frame, and attitude (yaw, pitch, roll), degrees. The
              velocity is the apparent displacement since the frame before (in frame 0: to frame 1). It is nan where the
              target is behind the camera in one of the two frames
    """

    frames: int
    now: Instant
    exposure: tuple[Instant, ...]
    motions: Floats

    @classmethod
    def of(cls, scenario: Scenario, context: SceneContext, frames: int) -> Trajectories:
        """Return the trajectories in the first frames of a scenario whose occluders are placed."""
        now = Instant.of(scenario, context, count=frames)
        offsets = scenario.camera.exposure_offsets(scenario.is_on)
        exposure = tuple(now if at == 0 else Instant.of(scenario, context, at, frames) for at in offsets)
        motions = [_motion(now.camera, each) for each in now.trajectories]
        return cls(frames, now, exposure, np.array(motions).reshape(len(motions), frames, 5))


def _motion(camera: CameraTrajectory, target: TargetTrajectory) -> Floats:
    """Return velocity and attitude of a target in each frame but the last, (n, 5)."""
    steps = np.diff(camera.project(target.positions), axis=0)
    velocities = np.concatenate([steps[:1], steps[:-1]])
    return np.hstack([velocities, angles_deg(target.attitudes)[: len(steps)]])


@lru_cache(maxsize=16)
def _chart(geometry: Geometry, turns: tuple[float, ...], margin: int, lens: Geometry) -> Chart:
    return Chart.at(geometry, geometry.world_rotation(np.array(turns)), margin, lens)


def _shifted(view: View, shift: tuple[float, float]) -> View:
    """Return the view of a target displaced in the picture, with exactly the same aspect."""
    context = view.context
    return view._replace(context=replace(context, geometry=replace(context.geometry, shift_px=shift)))


def apply_atmosphere(sprite: Sprite, pose: CameraPose, name: str | None = None) -> Sprite:
    """Return a sprite attenuated by the atmosphere, with path radiance; for a target `name` also with scintillation.

    Scintillation scales a target's contrast, so that a target as bright as its background stays invisible.
    """
    context, air = pose.context, pose.context.air
    if name is not None and air.turbulence.cn2 > 0:
        area = sprite.alpha.sum() * (sprite.range_m * pose.lens.ifov_rad) ** 2
        width = 2 * float(np.sqrt(area / np.pi))
        factor = air.turbulence.scintillation(name, pose.time, sprite.range_m, width, context.band, context.seed)
        sprite = sprite._replace(contrast=sprite.contrast * factor)
    if air.is_clear:
        return sprite
    tau, light = air.path(context.band, sprite.range_m, _elevation_rad(sprite, pose), pose.height_gain_m)
    own, added = tau * sprite.emission, light * sprite.alpha
    arrived = own + added
    total = arrived.sum()
    share = float(added.sum() / total) if total > 0 else 0.0
    (x, y), (own_x, own_y) = sprite.center, sprite.signal_center
    center = (own_x + share * (x - own_x), own_y + share * (y - own_y))
    samples = sprite.samples and sprite.samples.relit(tau, light)
    return sprite._replace(emission=arrived, signal_center=center, samples=samples)


def _elevation_rad(sprite: Sprite, pose: CameraPose) -> float:
    """Return the elevation of a sprite above the camera's horizontal, rad."""
    direction = pose.lens.directions(np.asarray(sprite.center)) @ pose.rotation
    return float(-np.arcsin(np.clip(direction @ pose.context.geometry.down, -1, 1)))


class _Run(NamedTuple):
    """Run of frames requested in order. Sprites of frames begin .. end-1 are drawn; `kept` has the latest."""

    begin: int
    end: int
    kept: Mapping[int, Sequence[NamedSprite]]


class Prefetch:
    """Sprites of `count` frames. Where frames are requested in order, `draw` draws several ahead.

    As many frames are drawn together as were requested in order before, up to `PREFETCHED`: short runs waste few.
    """

    def __init__(self, draw: Callable[[int], Iterable[NamedSprite]], count: int) -> None:
        self._draw = draw
        self._count = count
        self._run = _Run(0, 0, {})

    def pieces(self, index: int) -> Sequence[NamedSprite]:
        """Return the sprites of a frame, which the caller must not change."""
        run = self._run  # read once: another thread may replace it
        if index in run.kept:
            return run.kept[index]
        begin = run.begin if index == run.end else index
        together = min(index - begin, PREFETCHED) or 1
        found = self._drawn(index, min(index + together, self._count))
        small = sum(map(_pixels, found)) <= PREFETCHED_PX
        self._run = _Run(begin, index + len(found), dict(enumerate(found, index)) if small else {})
        return found[0]

    def _drawn(self, begin: int, end: int) -> list[Sequence[NamedSprite]]:
        """Return the sprites of frames begin .. end-1, or of fewer frames if these would exceed PREFETCHED_PX."""
        found: list[Sequence[NamedSprite]] = [list(self._draw(begin))]
        pixels = _pixels(found[0])
        for index in range(begin + 1, end):
            if pixels * (len(found) + 1) > PREFETCHED_PX * len(found):
                break
            try:
                found.append(list(self._draw(index)))
            except Exception:  # raised again when that frame is requested
                break
            pixels += _pixels(found[-1])
        return found


def _pixels(pieces: Iterable[NamedSprite]) -> int:
    """Return the number of pixels of all sprites, over all instants of the exposure."""
    sprites = [piece.sprite for piece in pieces]
    samples = sum(sprite.samples.alpha.size for sprite in sprites if sprite.samples is not None)
    return sum(sprite.alpha.size for sprite in sprites) + samples
