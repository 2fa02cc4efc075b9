"""One frame of a scenario: the noiseless scene, its ground truth, and the detector's counts."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from itertools import combinations
from typing import cast

import numpy as np

from irsim.backgrounds import Layer, MotionBlurredLayer, RecordedLayer
from irsim.geometry.pose import CameraPose
from irsim.geometry.sprite import Sprite, exposure_mean
from irsim.motion.camera_trajectory import zooms
from irsim.render.composite import DrawnTarget, NamedSprite, compose, contrast_k, uncovered
from irsim.render.contrast import NoiseRadiance, no_noise, with_radiance
from irsim.render.exposure import FIRST_FRAMES, Instant, Prefetch, Shifts, Trajectories, apply_atmosphere
from irsim.render.footage import footage_truth
from irsim.scenario.model import Scenario
from irsim.scenario.placement import with_placements
from irsim.types import Box, Counts, Floats, Frame, TargetTruth, Truth

NO_SHIFTS: Shifts = {}
"""Displacements for a scene in which no target is displaced."""


class Renderer:
    """Renderer of a scenario's frames in any order. Its construction paints textures and integrates paths.

    Frame k rendered alone equals frame k in sequence: values cached between frames only save time.
    """

    def __init__(self, scenario: Scenario, whole: Renderer | None = None) -> None:
        """`whole` is a renderer of the same scenario with nothing switched off. Its painted layers are shared where
        they are the same, and it gives the requested radiances."""
        self.scenario = scenario
        shown = with_placements(scenario)
        self.context = shown.context
        camera = shown.camera
        self._whole: Renderer | None = whole
        self._shown: Scenario = shown
        if whole is not None and whole.context == self.context and whole._shown.background == shown.background:
            self._painted: Sequence[Layer] = whole._painted
        else:
            self._painted = shown.background.layers(self.context)
        farthest, *nearer = self._painted
        self.layers = [farthest, *(layer for layer in nearer if scenario.is_on(layer.name))]
        self.recorded = cast(RecordedLayer, farthest) if scenario.background.has_noise else None
        self.occluders = [occluder for occluder in shown.occluders if scenario.is_on(occluder.name)]
        self.names = part_names(scenario)
        self.response_time = camera.response_time(scenario.is_on)
        self._frozen: tuple[int, Counts] | None = None
        self._prefetch = Prefetch(self.pieces, scenario.frames)
        self._requested = lru_cache(maxsize=2)(self._requested_radiances)
        every = np.arange(scenario.frames + 1.0) if camera.falloff else np.zeros(0)
        self.sensor = camera.signal_chain(scenario.seed, scenario.is_on, zooms(shown.motions, every, self.context))
        self.targets = [target for target in shown.targets if scenario.is_on(target.id)]
        self.classes = [target.cls or target.shape.default_class for target in self.targets]
        self._trajectories = Trajectories.of(shown, self.context, min(scenario.frames, FIRST_FRAMES))

    def trajectories(self, index: int) -> Trajectories:
        """Return the trajectories of camera and targets up to frame `index` or later.

        They are computed for the first `FIRST_FRAMES` frames, and for twice as many where a later frame is needed.
        """
        known = self._trajectories  # read once: another thread may replace it
        if index >= known.frames:
            frames = min(max(2 * known.frames, index + 1), self.scenario.frames)
            known = self._trajectories = Trajectories.of(self._shown, self.context, frames)
        return known

    def now(self, index: int) -> Instant:
        """Return the trajectories at the times of the frames, up to frame `index` or later."""
        return self.trajectories(index).now

    def frame(self, index: int, out: Counts | None = None) -> tuple[Frame, Truth]:
        """Return frame `index` and its truth. Its counts are written to `out` (rows, cols), if given."""
        return self.drawn_frame(index, out)[:2]

    def drawn_frame(self, index: int, out: Counts | None = None) -> tuple[Frame, Truth, list[DrawnTarget]]:
        """Return a frame and its truth as `frame`, and its drawn targets."""
        self.check(index)
        pieces = self._prefetch.pieces(index)
        light, drawn = self._composed(index, pieces)
        if self.recorded is not None:
            levels = self.recorded.insert_into(light, index, uncovered(pieces, light))
            image = _put(np.clip(np.rint(levels), 0, self.sensor.response.full).astype(np.uint16), out)
        else:
            image = self._counts(light, index, out)
        truth = self._truth(index, drawn, pieces)
        return Frame(image, index, truth.time, self.scenario.camera.bits), truth, drawn

    def _counts(self, light: Floats, index: int, out: Counts | None) -> Counts:
        """Return the counts of a frame from the radiance of its scene, (rows, cols) float32, which is overwritten."""
        shown = self.sensor.shown(index)
        if shown != index:
            return _put(self._frozen_frame(shown), out)
        if self.response_time.has_memory:
            light = self.response_time.light(index, lambda k: light if k == index else self.scene(k)[0])
        return self.sensor.expose(light, index, spent=True, out=out)

    def _frozen_frame(self, index: int) -> Counts:
        """Return the counts of the frame that the camera repeats while frozen; the last one is cached."""
        frozen = self._frozen  # read once: another thread may replace it
        if frozen is None or frozen[0] != index:
            frozen = self._frozen = index, self.sensor.expose(self.light(index), index, spent=True)
        return frozen[1].copy()

    def light(self, index: int) -> Floats:
        """Return the noiseless radiance after the detector's response time, (rows, cols) float32, W/m2/sr."""
        return self.response_time.light(index, lambda k: self.scene(k)[0])

    def variance(self, index: int, fixed: bool = True) -> Floats:
        """Return the noise variance of each pixel of a frame, (rows, cols) float64 counts²; see
        `SignalChain.variance`."""
        shown = self.sensor.shown(index)
        return self.sensor.variance(self.light(shown), shown, fixed)

    def scene(self, index: int) -> tuple[Floats, Truth]:
        """Return the noiseless in-band radiance of a frame, (rows, cols) float32 in W/m2/sr, and its truth."""
        self.check(index)
        pieces = self._prefetch.pieces(index)
        light, drawn = self._composed(index, pieces)
        return light, self._truth(index, drawn, pieces)

    def drawn_targets(self, index: int) -> list[DrawnTarget]:
        """Return the drawn targets of a frame, far to near."""
        self.check(index)
        return self._composed(index, self.pieces(index))[1]

    def check(self, index: int) -> None:
        """Raise IndexError where the scenario has no such frame."""
        if not 0 <= index < self.scenario.frames:
            raise IndexError(f"frame {index}: the scenario has frames 0 to {self.scenario.frames - 1}")

    def _composed(self, index: int, pieces: Iterable[NamedSprite]) -> tuple[Floats, list[DrawnTarget]]:
        view_direction, noise = self.now(index).view_direction(index), self.noise(index)
        return compose(self.layers_at(index), pieces, view_direction, self.context.band, noise)

    def noise(self, index: int) -> NoiseRadiance:
        """Return the camera's noise in a frame, as radiance. A recorded background has its own: it gets none."""
        return (
            no_noise if self.scenario.background.has_noise else self.sensor.noise_equivalent(self.sensor.shown(index))
        )

    def layers_at(self, index: int) -> Sequence[Layer]:
        """Return the layers of the background, each averaged over the exposure of a frame."""
        now, exposure = self.now(index), self.trajectories(index).exposure
        if all(now.has_same_pose(instant, index) for instant in exposure):
            return self.layers
        key = now.view_direction(index).key  # one key for all instants, so that textures stay cached
        directions = tuple(replace(instant.view_direction(index), key=key) for instant in exposure)
        return [MotionBlurredLayer(layer, directions) for layer in self.layers]

    @cached_property
    def _complete(self) -> Renderer:
        """Renderer of the same scenario with nothing switched off."""
        if not self.scenario.without:
            return self
        return self._whole or Renderer(self.scenario.model_copy(update={"without": ()}))

    def _requested_radiances(self, index: int) -> Mapping[str, float]:
        """Return the radiance, W/m2/sr, of each visible target with a requested contrast or SCR, by id of the target.

        It is computed from the whole scenario with no target displaced. Thus switching off one part leaves the radiance
        of all other targets unchanged.
        """
        drawn = self._complete._composed(index, self._complete.pieces(index))[1]
        return {target.piece.name: target.requested for target in drawn if target.requested is not None}

    def pieces(
        self, index: int, shifts: Shifts = NO_SHIFTS, exactly: bool = False, only: Container[str] | None = None
    ) -> Iterator[NamedSprite]:
        """Yield the sprites of a frame's targets and occluders, or only those of the targets in `only`.

        exactly  targets with a requested contrast or SCR get the radiance that they have in the unchanged frame, even
                 if targets are displaced or left out, or computed in float64
        """
        pose = self.pose(index)
        as_given = exactly or bool(self.scenario.without)
        present = [
            number
            for number, target in enumerate(self.targets)
            if target.exists(index) and (only is None or target.id in only)
        ]
        drawn = self._exposed(index, lambda instant: instant.sprites(index, present, shifts))
        for number, sprite in zip(present, drawn, strict=True):
            if sprite is not None:
                trajectory, target = self.now(index).trajectories[number], self.targets[number]
                arrived = apply_atmosphere(sprite, pose, target.id)
                if arrived.requested is not None and as_given:
                    requested = self._requested(index).get(target.id)
                    arrived = arrived if requested is None else with_radiance(arrived, requested)
                if target.contrast != 1:
                    arrived = arrived._replace(contrast=arrived.contrast * target.contrast)
                yield NamedSprite(
                    target.id, arrived, tracked=True, range_from_origin_m=trajectory.range_from_origin_m(index, pose)
                )
        if only is not None or not self.occluders:
            return
        occluding = self._exposed(index, lambda instant: [each.draw(instant.pose(index)) for each in self.occluders])
        for occluder, sprite in zip(self.occluders, occluding, strict=True):
            if sprite is not None:
                range_from_origin_m = occluder.range_m if pose.has_moved else None
                yield NamedSprite(
                    occluder.name,
                    apply_atmosphere(sprite, pose),
                    tracked=False,
                    range_from_origin_m=range_from_origin_m,
                )

    def _exposed(self, index: int, draw: Callable[[Instant], list[Sprite | None]]) -> list[Sprite | None]:
        """Return the sprites that `draw` makes at each instant, averaged over the exposure of a frame."""
        middles, exposure = draw(self.now(index)), self.trajectories(index).exposure
        if len(exposure) == 1:
            return middles
        instants, (columns, rows) = [draw(instant) for instant in exposure], self.scenario.camera.size
        return [
            exposure_mean(middle, each, (rows, columns))
            for middle, each in zip(middles, zip(*instants, strict=True), strict=True)
        ]

    def pose(self, index: int) -> CameraPose:
        """Return the camera's pose in frame `index`."""
        return self.now(index).pose(index)

    def _truth(self, index: int, drawn: list[DrawnTarget], pieces: Sequence[NamedSprite]) -> Truth:
        found = {target.piece.name: target for target in drawn}
        own = footage_truth(self.scenario.background.recorded_truth(index), pieces, self.names)
        boxes = {name: target.piece.sprite.box for name, target in found.items()}
        crossing = _crossing(boxes | {target.id: target.box for target in own})
        motions = self.trajectories(index).motions[:, index].tolist()
        targets = [
            self._target_truth(target.id, cls, found[target.id], motion, target.id in crossing)
            for target, cls, motion in zip(self.targets, self.classes, motions, strict=True)
            if target.id in found
        ]
        targets += [replace(target, crossing=True) if target.id in crossing else target for target in own]
        pose = self.now(index).camera.pose(index) if self.recorded is None else None
        return Truth(index, index / self.context.rate_hz, tuple(targets), pose)

    def _target_truth(
        self, name: str, cls: str, drawn: DrawnTarget, motion: list[float], crossing: bool
    ) -> TargetTruth:
        sprite = drawn.piece.sprite
        vx, vy, yaw, pitch, roll = motion
        return TargetTruth(
            id=name,
            center=sprite.center,
            box=sprite.box,
            cls=cls,
            signal_center=sprite.signal_center,
            velocity=(vx, vy) if math.isfinite(vx) and math.isfinite(vy) else None,
            attitude=(yaw, pitch, roll),
            range_m=sprite.range_m,
            visible=drawn.visible,
            occluders=tuple(drawn.occluders),
            crossing=crossing,
            in_view=self.context.geometry.inside(*sprite.center),
            contrast_k=contrast_k(drawn, self.context.band),
            scr=drawn.scr,
        )


def part_names(scenario: Scenario) -> set[str]:
    """Return the names of a scenario's targets and occluders, switched off or not."""
    return {target.id for target in scenario.targets} | {occluder.name for occluder in scenario.occluders}


def _put(image: Counts, out: Counts | None) -> Counts:
    if out is None:
        return image
    np.copyto(out, image)
    return out


def _crossing(boxes: dict[str, Box]) -> set[str]:
    """Return the names of boxes that overlap another box (IoU above 0)."""
    crossing = set()
    for (one, (left, top, right, bottom)), (other, (west, north, east, south)) in combinations(
        [(name, box.edges) for name, box in boxes.items() if box.w > 0 and box.h > 0], 2
    ):
        if left < east and west < right and top < south and north < bottom:
            crossing |= {one, other}
    return crossing
