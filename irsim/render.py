"""One frame of a scenario: the noiseless scene, its truth, and the detector's counts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from irsim.arrival import arriving
from irsim.backgrounds import Footage, Gaze
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.painting import BLOCK, MARGIN
from irsim.compose import Piece, Seen, compose
from irsim.contrast import NETD_AT_K
from irsim.course import Course
from irsim.geometry import Geometry
from irsim.intent import placed
from irsim.motion import Mount, angles_deg
from irsim.occluders import Sight
from irsim.radiometry import slope
from irsim.scenario import Scenario
from irsim.shapes import draw_all
from irsim.types import Box, Floats, Frame, Image, TargetTruth, Truth


class Renderer:
    """A scenario made ready: textures painted, paths integrated. Frames may be asked for in any order."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.stage = scenario.stage
        camera = scenario.camera
        farthest, *nearer = scenario.background.layers(self.stage)
        self.layers = [farthest, *(layer for layer in nearer if scenario.is_on(layer.name))]
        self.occluders = [occluder for occluder in placed(scenario) if scenario.is_on(occluder.name)]
        self.sensor = camera.sensor(scenario.seed, scenario.is_on)
        self.lag = camera.lag(scenario.is_on)
        self.noise = self.stage.noise_k * slope(self.stage.band, NETD_AT_K)
        self._held: tuple[int, Image] | None = None
        count = scenario.frames + 1  # one more: frame 0 takes its velocity from frame 1
        motions = [motion for motion in camera.motion if scenario.is_on(motion.name)]
        frames = np.arange(float(count))
        tilt = self.stage.air.turbulence.turns(frames, self.stage.band, self.stage.rate_hz, self.stage.seed)
        still = Mount.of(motions, frames, self.stage)
        self.mount = replace(still, turns=still.turns + tilt)
        self.courses = [
            Course.of(target, count, self.stage) for target in scenario.targets if scenario.is_on(target.id)
        ]
        self.angles_deg = [angles_deg(course.attitudes) for course in self.courses]
        self.velocities = [self._velocities(course.positions) for course in self.courses]

    def _velocities(self, positions: Floats) -> Floats:
        """(n, 2) px per frame: the apparent displacement since the frame before (frame 0: to the next);
        nan where it is behind the camera in one of the two."""
        steps = np.diff(self.mount.seen(positions), axis=0)
        return np.concatenate([steps[:1], steps[:-1]])

    def frame(self, index: int) -> tuple[Frame, Truth]:
        """Frame `index` and its truth. IndexError outside 0 .. frames-1."""
        light, truth = self.scene(index)
        shown = self.sensor.shown(index)
        image: Image
        if isinstance(self.layers[0], Footage):
            image = self.layers[0].developed(light, index)
            return Frame(image, index, truth.time, self.scenario.camera.bits), truth
        if shown == index:
            settled = self.lag.light(index, lambda k: light if k == index else self.scene(k)[0])
            image = self.sensor.expose(settled, index)
        else:
            image = self._standing(shown)
        return Frame(image, index, truth.time, self.scenario.camera.bits), truth

    def _standing(self, index: int) -> Image:
        """The picture of a frame that is shown again; the last one is kept, which changes nothing."""
        if self._held is None or self._held[0] != index:
            self._held = index, self.sensor.expose(self.light(index), index)
        return self._held[1].copy()

    def light(self, index: int) -> Floats:
        """The noiseless picture that the detector has settled to, (rows, cols) float32 in W/m2/sr."""
        return self.lag.light(index, lambda k: self.scene(k)[0])

    def variance(self, index: int, fixed: bool = True) -> Floats:
        """Noise of each pixel of a frame, (rows, cols) float64 counts^2; see `Sensor.variance`."""
        shown = self.sensor.shown(index)
        return self.sensor.variance(self.light(shown), shown, fixed)

    def scene(self, index: int) -> tuple[Floats, Truth]:
        """The noiseless picture, in-band radiance (rows, cols) float32 in W/m2/sr, and its truth."""
        if not 0 <= index < self.scenario.frames:
            raise IndexError(f"frame {index}: the scenario has frames 0 to {self.scenario.frames - 1}")
        time = index / self.stage.rate_hz
        gaze = self._gaze(index)
        pieces = self._pieces(index)
        light, seen = compose(self.layers, pieces, gaze, self.stage.band, self.noise)
        return light, self._truth(index, time, seen)

    def _gaze(self, index: int) -> Gaze:
        """A frame's pointing, with that of its block's first frame as key."""
        geometry, mount, first = self.stage.geometry, self.mount, index // BLOCK * BLOCK

        def at(frame: int, margin: int, key: Gaze | None) -> Gaze:
            chart = _chart(geometry, tuple(mount.turns[frame].tolist()), margin, mount.lens(frame))
            x, y, z = (geometry.world_rotation(np.zeros(3)).T @ mount.places[frame]).tolist()
            return Gaze(frame / self.stage.rate_hz, chart, key, (x, y, z))

        return at(index, 0, at(first, MARGIN, None))

    def _pieces(self, index: int) -> Iterator[Piece]:
        sight = self.sight(index)
        present = [course for course in self.courses if course.target.exists(index)]
        views = [(course.target.shape, course.view(index, self.mount, self.stage)) for course in present]
        for course, sprite in zip(present, draw_all(views), strict=True):
            if sprite is not None:
                arrived = replace(arriving(sprite, sight, course.target.id), contrast=course.target.contrast)
                yield Piece(course.target.id, arrived, tracked=True)
        for occluder in self.occluders:
            sprite = occluder.draw(sight)
            if sprite is not None:
                yield Piece(occluder.name, arriving(sprite, sight), tracked=False)

    def sight(self, index: int) -> Sight:
        """How the camera of frame `index` sees what stands about it."""
        mount = self.mount
        rotation, place = mount.rotation(index), mount.places[index]
        return Sight(self.stage, mount.lens(index), rotation, place, index / self.stage.rate_hz)

    def _truth(self, index: int, time: float, seen: list[Seen]) -> Truth:
        boxes = {target.piece.name: target.piece.sprite.box for target in seen}
        found = {target.piece.name: target for target in seen}
        return Truth(
            index,
            time,
            tuple(
                self._target_truth(number, index, found[course.target.id], boxes)
                for number, course in enumerate(self.courses)
                if course.target.id in found
            ),
        )

    def _target_truth(self, number: int, index: int, seen: Seen, boxes: dict[str, Box]) -> TargetTruth:
        target, sprite = self.courses[number].target, seen.piece.sprite
        others = (box for name, box in boxes.items() if name != target.id)
        velocity = self.velocities[number][index]
        yaw, pitch, roll = self.angles_deg[number][index]
        return TargetTruth(
            id=target.id,
            center=sprite.center,
            box=sprite.box,
            cls=target.cls or target.shape.stands_for,
            signal_center=sprite.signal_center,
            velocity=(float(velocity[0]), float(velocity[1])) if np.isfinite(velocity).all() else None,
            attitude=(float(yaw), float(pitch), float(roll)),
            range_m=sprite.range_m,
            visible=seen.visible,
            occluders=tuple(seen.occluders),
            crossing=any(sprite.box.iou(other) > 0 for other in others),
            in_view=self.stage.geometry.inside(*sprite.center),
            contrast_k=seen.contrast_k,
            scr=seen.scr,
        )


@lru_cache(maxsize=8)
def _chart(geometry: Geometry, turns: tuple[float, ...], margin: int, lens: Geometry) -> Chart:
    """The chart of a camera turned so; one that stands still has the same in all frames, and what is kept for it."""
    return Chart.at(geometry, geometry.world_rotation(np.array(turns)), margin, lens)
