"""A planted failure: a scene of 64x48 px in which a point starts anywhere, and a tracker that is blind from one place.

The tracker says where the point is, but the nearer its start is to the blind place, the farther off; it is lost just
where that place begins: 0.05 by 0.1 of the ranges, 0.5 % of the space. Within it lie the severities (3, 4).
"""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from irsim.types import Box, Frame
from irtrack.metrics.lost import OFF_PX
from irtrack.types import Estimate

SCENE = """
seed: 1
frames: 13
camera: {size: [64, 48], elevation_deg: 8, netd_mk: 40}
background: {kind: sky, horizon_k: 280, zenith_k: 260}
targets:
  - id: point
    shape: {kind: point, temperature_k: 400, area_m2: 1}
    path: {kind: straight, start: [4, 4], speed: 0.1, range_m: 2000}
vary:
  targets.point.path.start.0: {kind: uniform, low: 4, high: 54}
  targets.point.path.start.1: {kind: uniform, low: 4, high: 44}
  targets.point.shape.area_m2: {kind: loguniform, low: 0.5, high: 2}
"""
LOWEST = {"targets.point.path.start.0": 34.0, "targets.point.path.start.1": 36.0, "targets.point.shape.area_m2": 1.0}
"""The smallest that fails: severities 3, 4 and 0."""

MIDDLE, HALF_WIDTH = np.array([0.605, 0.8]), np.array([0.025, 0.05])
LOW, WIDTH = np.array([4.0, 4.0]), np.array([50.0, 40.0])


def inside(start: tuple[float, float]) -> float:
    """Above 0 within the blind place, at most 1; below 0 as far as the start is from it, in shares of the ranges."""
    away = np.abs((np.array(start) - LOW) / WIDTH - MIDDLE)
    return float(np.min((HALF_WIDTH - away) / np.where(away < HALF_WIDTH, HALF_WIDTH, 1)))


@dataclass(frozen=True)
class Blind:
    """Loses what starts in the blind place."""

    resumable: ClassVar[bool] = True

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> tuple[Box, int]:
        return box, frame.index

    def step(self, state: tuple[Box, int], frame: Frame, rng: np.random.Generator) -> tuple[object, Estimate]:
        box, start = state
        radius = OFF_PX * (1 + inside((box.cx, box.cy)))
        moved = 0.1 * (frame.index - start)
        return state, Estimate((box.cx + moved, box.cy - radius), (box.w, box.h))


class Raising(Blind):
    """Raises in frame 9 there, and elsewhere does well."""

    def step(self, state: tuple[Box, int], frame: Frame, rng: np.random.Generator) -> tuple[object, Estimate]:
        box, start = state
        if inside((box.cx, box.cy)) > 0 and frame.index == 9:
            self.fail()
        return state, Estimate((box.cx + 0.1 * (frame.index - start), box.cy), (box.w, box.h))

    def fail(self) -> None:
        raise ValueError("planted")


class Exiting(Raising):
    """Ends its process there."""

    def fail(self) -> None:
        os._exit(7)


class Crashing(Raising):
    """Ends its process as a fault in native code does."""

    def fail(self) -> None:
        os.kill(os.getpid(), signal.SIGSEGV)


class Hanging(Raising):
    """Hangs there, for ever as far as a test goes."""

    def fail(self) -> None:
        time.sleep(600)


class Lucky(Blind):
    """Loses by chance, one seed in two, whatever the scene."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> tuple[Box, int]:
        return (Box(32.5, 36.0, 5, 5) if rng.random() < 0.5 else box), frame.index


class Unrepeatable(Blind):
    """Is a little elsewhere every time that it runs."""

    runs: ClassVar[list[int]] = []

    def step(self, state: tuple[Box, int], frame: Frame, rng: np.random.Generator) -> tuple[object, Estimate]:
        self.runs.append(frame.index)
        return state, Estimate((0.001 * len(self.runs), 1.0), (5, 5))


@dataclass(frozen=True)
class Offset(Blind):
    """Beside the target by so many px, in every frame."""

    px: float = 2.0

    def step(self, state: tuple[Box, int], frame: Frame, rng: np.random.Generator) -> tuple[object, Estimate]:
        box, start = state
        return state, Estimate((box.cx + 0.1 * (frame.index - start), box.cy + self.px), (box.w, box.h))


class Slow(Offset):
    """Takes a while for frame 9."""

    def step(self, state: tuple[Box, int], frame: Frame, rng: np.random.Generator) -> tuple[object, Estimate]:
        if frame.index == 9:
            time.sleep(4)
        return super().step(state, frame, rng)
