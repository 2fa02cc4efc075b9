"""Planted failures of a detector and of a tracker of many: both are wrong where the point is right of column 30."""

from __future__ import annotations

import numpy as np

from irsim.types import Box, Frame
from irtrack.tracks import TrackFrame
from irtrack.types import Detection, Detections

SCENE = """
seed: 1
frames: 16
camera: {size: [64, 48], rate_hz: 10, elevation_deg: 8, netd_mk: 40}
background: {kind: sky, horizon_k: 280, zenith_k: 260}
targets:
  - id: point
    shape: {kind: point, temperature_k: 400, area_m2: 1}
    path: {kind: straight, start: [4, 24], speed: 0.1, range_m: 2000}
vary:
  targets.point.path.start.0: {kind: uniform, low: 4, high: 54}
"""
EDGE = 30


def brightest(frame: Frame) -> Box:
    row, column = divmod(int(frame.image.argmax()), frame.image.shape[1])
    return Box(column, row, 5, 5)


class Blind:
    """Detector that misses the point in four of five frames on the right."""

    task = "detect"

    def step(self, state: object, frame: Frame) -> tuple[object, Detections]:
        box = brightest(frame)
        missed = box.cx > EDGE and frame.index % 5
        return None, Detections.of([] if missed else [Detection(box, 1.0)])


class Images(Blind):
    """Detector that answers with the image on the right."""

    def step(self, state: object, frame: Frame) -> tuple[object, Detections]:
        answer = super().step(state, frame)
        return answer if brightest(frame).cx <= EDGE else (None, frame.image)  # type: ignore[return-value]  # the plant


class Switching:
    """Tracker of many whose track of the point has another id from frame 9 on, on the right."""

    task = "many"

    def init(self, frame: Frame, rng: np.random.Generator) -> None:
        return None

    def step(self, state: None, frame: Frame, rng: np.random.Generator) -> tuple[None, TrackFrame]:
        box = brightest(frame)
        return None, TrackFrame.of([(int(box.cx > EDGE and frame.index >= 9), box, 1.0)])


class Doubling(Switching):
    """Tracker of many that gives two tracks one id in frame 3."""

    def step(self, state: None, frame: Frame, rng: np.random.Generator) -> tuple[None, TrackFrame]:
        box = brightest(frame)
        return None, TrackFrame.of([(7, box, 1.0)] * (1 + (frame.index == 3)))


class Right(Blind):
    """Detector that finds the point everywhere."""

    def step(self, state: object, frame: Frame) -> tuple[object, Detections]:
        return None, Detections.of([Detection(brightest(frame), 1.0)])


class RightMany(Switching):
    """Tracker of many that keeps one id."""

    def step(self, state: None, frame: Frame, rng: np.random.Generator) -> tuple[None, TrackFrame]:
        return None, TrackFrame.of([(0, brightest(frame), 1.0)])
