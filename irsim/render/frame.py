"""One frame of a scenario: the noiseless scene, its truth, and the detector's counts."""

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
from irsim.geometry.sprite import Sprite, averaged
from irsim.motion import angles_deg
from irsim.render.arrival import arriving
from irsim.render.composite import Piece, Seen, compose, contrast_k, uncovered
from irsim.render.contrast import Noise, lit, quiet
from irsim.render.instant import Instant, Shifts
from irsim.render.prefetch import Ahead
from irsim.scenario.model import Scenario
from irsim.scenario.placement_all import built
from irsim.types import Box, Counts, Floats, Frame, TargetTruth, Truth

NOWHERE: Shifts = {}
"""No target is moved."""


class Renderer:
    """A scenario made ready: textures painted, paths integrated. Frames may be asked for in any order."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        shown = built(scenario)
        self.context = shown.context
        camera = shown.camera
        farthest, *nearer = shown.background.layers(self.context)
        self.layers = [farthest, *(layer for layer in nearer if scenario.is_on(layer.name))]
        self.film = cast(RecordedLayer, farthest) if scenario.background.has_noise else None
        self.occluders = [occluder for occluder in shown.occluders if scenario.is_on(occluder.name)]
        self.lag = camera.lag(scenario.is_on)
        self._held: tuple[int, Counts] | None = None
        self._ahead = Ahead(self.pieces, scenario.frames)
        self._asked = lru_cache(maxsize=2)(self._asked_for)
        self.now = Instant.of(shown, self.context)
        self.sensor = camera.sensor(scenario.seed, scenario.is_on, self.now.mount.zooms)
        self.exposure = [
            self.now if offset == 0 else Instant.of(shown, self.context, offset)
            for offset in camera.instants(scenario.is_on)
        ]
        self.courses = self.now.courses
        self.targets = [course.target for course in self.courses]
        self.classes = [target.cls or target.shape.stands_for for target in self.targets]
        motions = [self._motion(course.positions, course.attitudes) for course in self.courses]
        self.motions = np.array(motions).reshape(len(motions), scenario.frames, 5)

    def _motion(self, positions: Floats, attitudes: Floats) -> Floats:
        """(n, 5): velocity (vx, vy), px per frame, the apparent displacement since the frame before (frame 0: to the
        next), nan where it is behind the camera in one of the two; and attitude (yaw, pitch, roll), degrees."""
        steps = np.diff(self.now.mount.seen(positions), axis=0)
        velocities = np.concatenate([steps[:1], steps[:-1]])
        return np.hstack([velocities, angles_deg(attitudes)[: len(steps)]])

    def frame(self, index: int, out: Counts | None = None) -> tuple[Frame, Truth]:
        """Frame `index`, in `out` (rows, cols) where it is given, and its truth. IndexError outside 0 .. frames-1."""
        if self.film is not None:
            image, truth = self._put_into(self.film, index)
            return Frame(_put(image, out), index, truth.time, self.scenario.camera.bits), truth
        light, truth = self.scene(index)
        image = self._counts(light, index, out)
        return Frame(image, index, truth.time, self.scenario.camera.bits), truth

    def _counts(self, light: Floats, index: int, out: Counts | None) -> Counts:
        """Return the counts of a frame whose scene has the light (rows, cols) float32, which is written over."""
        shown = self.sensor.shown(index)
        if shown != index:
            return _put(self._standing(shown), out)
        if self.lag.remembers:
            light = self.lag.light(index, lambda k: light if k == index else self.scene(k)[0])
        return self.sensor.expose(light, index, spent=True, out=out)

    def _put_into(self, film: RecordedLayer, index: int) -> tuple[Counts, Truth]:
        """A recorded frame with all that is drawn into it, each thing once."""
        self.check(index)
        pieces = self._ahead.pieces(index)
        light, seen = self._laid(index, pieces)
        levels = film.insert_into(light, index, uncovered(pieces, light))
        image = np.clip(np.rint(levels), 0, self.sensor.response.full).astype(np.uint16)
        return image, self._truth(index, seen)

    def _standing(self, index: int) -> Counts:
        """The picture of a frame that is shown again; the last one is kept, which changes nothing."""
        held = self._held  # once: another thread may put its own there
        if held is None or held[0] != index:
            held = self._held = index, self.sensor.expose(self.light(index), index, spent=True)
        return held[1].copy()

    def light(self, index: int) -> Floats:
        """The noiseless picture that the detector has settled to, (rows, cols) float32 in W/m2/sr."""
        return self.lag.light(index, lambda k: self.scene(k)[0])

    def variance(self, index: int, fixed: bool = True) -> Floats:
        """Noise of each pixel of a frame, (rows, cols) float64 counts^2; see `Sensor.variance`."""
        shown = self.sensor.shown(index)
        return self.sensor.variance(self.light(shown), shown, fixed)

    def scene(self, index: int, out: Floats | None = None) -> tuple[Floats, Truth]:
        """The noiseless picture, in-band radiance (rows, cols) float32 in W/m2/sr, and its truth; the picture in `out`,
        where it is given."""
        self.check(index)
        light, seen = self._laid(index, self._ahead.pieces(index), out)
        return light, self._truth(index, seen)

    def seen(self, index: int) -> list[Seen]:
        """The targets as a frame shows them, far to near."""
        self.check(index)
        return self._laid(index, self.pieces(index))[1]

    def check(self, index: int) -> None:
        """IndexError where the scenario has no such frame."""
        if not 0 <= index < self.scenario.frames:
            raise IndexError(f"frame {index}: the scenario has frames 0 to {self.scenario.frames - 1}")

    def _laid(self, index: int, pieces: Iterable[Piece], out: Floats | None = None) -> tuple[Floats, list[Seen]]:
        return compose(
            self.layers_at(index), pieces, self.now.view_direction(index), self.context.band, self.noise(index), out
        )

    def noise(self, index: int) -> Noise:
        """The camera's in the picture that a frame shows, as light; none where the background holds it already."""
        return quiet if self.scenario.background.has_noise else self.sensor.equivalent(self.sensor.shown(index))

    def layers_at(self, index: int) -> Sequence[Layer]:
        """The layers, each as it is seen over the whole exposure of a frame."""
        if all(self.now.looks_as(instant, index) for instant in self.exposure):
            return self.layers
        key = self.now.view_direction(index).key  # of one key, or nothing that is painted would be kept
        gazes = tuple(replace(instant.view_direction(index), key=key) for instant in self.exposure)
        return [MotionBlurredLayer(layer, gazes) for layer in self.layers]

    @cached_property
    def _given(self) -> Renderer:
        """Of the same scenario with nothing switched off."""
        without = self.scenario.without
        return Renderer(self.scenario.model_copy(update={"without": ()})) if without else self

    def _asked_for(self, index: int) -> Mapping[str, float]:
        """Light, W/m2/sr, of each target that asks for a contrast or an SCR and is in the picture, by its id.

        It is found with nothing switched off and no target moved or left out: what a scene has less of changes
        nothing else in it.
        """
        seen = self._given._laid(index, self._given.pieces(index))[1]
        return {target.piece.name: target.asked for target in seen if target.asked is not None}

    def pieces(
        self, index: int, shifts: Shifts = NOWHERE, exactly: bool = False, only: Container[str] | None = None
    ) -> Iterator[Piece]:
        """The things of a frame, or `only` some of its targets. exactly: those that ask for a contrast or an SCR have
        the light that frames show, whatever is moved, left out, or worked out in more digits."""
        pose = self.pose(index)
        as_given = exactly or bool(self.scenario.without)
        present = [
            number
            for number, target in enumerate(self.targets)
            if target.exists(index) and (only is None or target.id in only)
        ]
        drawn = self._exposed(lambda instant: instant.sprites(index, present, shifts))
        for number, sprite in zip(present, drawn, strict=True):
            if sprite is not None:
                course, target = self.courses[number], self.targets[number]
                arrived = arriving(sprite, pose, target.id)
                if arrived.wanted is not None and as_given:
                    asked = self._asked(index).get(target.id)
                    arrived = arrived if asked is None else lit(arrived, asked)
                if target.contrast != 1:
                    arrived = arrived._replace(contrast=arrived.contrast * target.contrast)
                yield Piece(target.id, arrived, tracked=True, first_m=course.first_m(index, pose))
        if only is not None or not self.occluders:
            return
        standing = self._exposed(lambda instant: [each.draw(instant.pose(index)) for each in self.occluders])
        for occluder, sprite in zip(self.occluders, standing, strict=True):
            if sprite is not None:
                first_m = occluder.range_m if pose.carried else None
                yield Piece(occluder.name, arriving(sprite, pose), tracked=False, first_m=first_m)

    def _exposed(self, draw: Callable[[Instant], list[Sprite | None]]) -> list[Sprite | None]:
        """What things are over the whole exposure."""
        middles = draw(self.now)
        if len(self.exposure) == 1:
            return middles
        instants = [draw(instant) for instant in self.exposure]
        return [averaged(middle, each) for middle, each in zip(middles, zip(*instants, strict=True), strict=True)]

    def pose(self, index: int) -> CameraPose:
        """How the camera of frame `index` sees what stands about it."""
        return self.now.pose(index)

    def _truth(self, index: int, seen: list[Seen]) -> Truth:
        found = {target.piece.name: target for target in seen}
        crossing = _crossing({name: target.piece.sprite.box for name, target in found.items()})
        motions = self.motions[:, index].tolist()
        targets = [
            self._target_truth(target.id, cls, found[target.id], motion, target.id in crossing)
            for target, cls, motion in zip(self.targets, self.classes, motions, strict=True)
            if target.id in found
        ]
        return Truth(index, index / self.context.rate_hz, tuple(targets))

    def _target_truth(self, name: str, cls: str, seen: Seen, motion: list[float], crossing: bool) -> TargetTruth:
        sprite = seen.piece.sprite
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
            visible=seen.visible,
            occluders=tuple(seen.occluders),
            crossing=crossing,
            in_view=self.context.geometry.inside(*sprite.center),
            contrast_k=contrast_k(seen, self.context.band),
            scr=seen.scr,
        )


def _put(image: Counts, out: Counts | None) -> Counts:
    if out is None:
        return image
    np.copyto(out, image)
    return out


def _crossing(boxes: dict[str, Box]) -> set[str]:
    """Names of the boxes that meet another one: those with `iou` above 0."""
    crossing = set()
    for (one, (left, top, right, bottom)), (other, (west, north, east, south)) in combinations(
        [(name, box.edges) for name, box in boxes.items() if box.w > 0 and box.h > 0], 2
    ):
        if left < east and west < right and top < south and north < bottom:
            crossing |= {one, other}
    return crossing
