"""One frame of a scenario: the noiseless scene, its truth, and the detector's counts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from irsim.backgrounds import Gaze
from irsim.backgrounds.chart import Chart
from irsim.compose import Piece, Seen, compose
from irsim.detector import expose
from irsim.motion import angles_deg, attitudes
from irsim.scenario import Scenario, Target
from irsim.shapes import View
from irsim.types import Box, Floats, Frame, TargetTruth, Truth


@dataclass(frozen=True, eq=False)
class Course:
    """A target's whole way, frames 0 .. n-1, in the first camera frame.

    positions (n, 3) m;  attitudes (n, 3, 3) body to first camera;  angles_deg (n, 3) yaw, pitch, roll
    velocities (n, 2) px per frame: the apparent displacement since the frame before (frame 0: to the next)
    """

    target: Target
    positions: Floats
    attitudes: Floats
    angles_deg: Floats
    velocities: Floats


class Renderer:
    """A scenario made ready: textures painted, paths integrated. Frames may be asked for in any order."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.stage = scenario.stage
        camera = scenario.camera
        self.layers = [layer for layer in scenario.background.layers(self.stage) if scenario.is_on(layer.name)]
        self.occluders = [occluder for occluder in scenario.occluders if scenario.is_on(occluder.name)]
        self.noises = [noise for noise in camera.noise if scenario.is_on(noise.name)]
        frames = np.arange(scenario.frames + 1.0)  # one more: frame 0 takes its velocity from frame 1
        motions = [motion.turns(frames, self.stage) for motion in camera.motion if scenario.is_on(motion.name)]
        self.turns = np.sum([np.zeros((len(frames), 3)), *motions], axis=0)
        rotations = np.stack([self.stage.geometry.rotation(turn) for turn in self.turns])
        self.courses = [
            self._course(target, frames, rotations) for target in scenario.targets if scenario.is_on(target.id)
        ]

    def _course(self, target: Target, frames: Floats, rotations: Floats) -> Course:
        positions = target.path.positions(frames, self.stage, target.id)
        attitude = attitudes(
            target.path, frames, self.stage, target.id, target.attitude_deg, target.spin_deg_s, target.shape.banks
        )
        pixels = self.stage.geometry.project(np.einsum("nij,nj->ni", rotations, positions))
        steps = np.diff(pixels, axis=0)
        velocities = np.concatenate([steps[:1], steps[:-1]])
        return Course(target, positions[:-1], attitude[:-1], angles_deg(attitude[:-1]), velocities)

    def frame(self, index: int) -> tuple[Frame, Truth]:
        """Frame `index` and its truth. IndexError outside 0 .. frames-1."""
        light, truth = self.scene(index)
        camera, seed = self.scenario.camera, self.stage.seed
        patterns = [noise.pattern(index, light.shape, camera.rate_hz, seed) for noise in self.noises]
        counts = expose(light, patterns, camera.netd_mk, camera.band, camera.range_k, camera.bits)
        return Frame(counts, index, truth.time, camera.bits), truth

    def scene(self, index: int) -> tuple[Floats, Truth]:
        """The noiseless picture, in-band radiance (rows, cols) float32 in W/m2/sr, and its truth."""
        if not 0 <= index < self.scenario.frames:
            raise IndexError(f"frame {index}: the scenario has frames 0 to {self.scenario.frames - 1}")
        geometry, time = self.stage.geometry, index / self.stage.rate_hz
        gaze = Gaze(time, Chart.at(geometry, geometry.world_rotation(self.turns[index])))
        pieces = self._pieces(index, geometry.rotation(self.turns[index]))
        light, seen = compose(self.layers, pieces, gaze, self.stage.band)
        return light, self._truth(index, time, seen)

    def _pieces(self, index: int, rotation: Floats) -> Iterator[Piece]:
        for course in self.courses:
            time = index / self.stage.rate_hz
            view = View(rotation @ course.positions[index], rotation @ course.attitudes[index], self.stage, time)
            sprite = course.target.shape.draw(view)
            if sprite is not None:
                yield Piece(course.target.id, sprite, tracked=True)
        for occluder in self.occluders:
            sprite = occluder.draw(rotation, self.stage)
            if sprite is not None:
                yield Piece(occluder.name, sprite, tracked=False)

    def _truth(self, index: int, time: float, seen: list[Seen]) -> Truth:
        boxes = {target.piece.name: target.piece.sprite.box for target in seen}
        found = {target.piece.name: target for target in seen}
        return Truth(
            index,
            time,
            tuple(
                self._target_truth(course, index, found[course.target.id], boxes)
                for course in self.courses
                if course.target.id in found
            ),
        )

    def _target_truth(self, course: Course, index: int, seen: Seen, boxes: dict[str, Box]) -> TargetTruth:
        target, sprite = course.target, seen.piece.sprite
        others = (box for name, box in boxes.items() if name != target.id)
        vx, vy = course.velocities[index]
        yaw, pitch, roll = course.angles_deg[index]
        return TargetTruth(
            id=target.id,
            center=sprite.center,
            box=sprite.box,
            cls=target.cls or target.shape.kind,
            signal_center=sprite.signal_center,
            velocity=(float(vx), float(vy)),
            attitude=(float(yaw), float(pitch), float(roll)),
            range_m=sprite.range_m,
            visible=seen.visible,
            occluders=tuple(seen.occluders),
            crossing=any(sprite.box.iou(other) > 0 for other in others),
            in_view=self.stage.geometry.inside(*sprite.center),
            contrast_k=seen.contrast_k,
        )
