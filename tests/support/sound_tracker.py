"""A small honest tracker, `Sound`: the centroid of what stands out in a window. And those that cannot be tried."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Floats, Frame
from irtrack.types import Estimate

Answer = tuple["State", Estimate]


@dataclass(frozen=True)
class State:
    """What `Sound` remembers; `memory` is for the planted ones."""

    x: float
    y: float
    w: float
    h: float
    contrast: float
    velocity: tuple[float, float] = (0.0, 0.0)
    steps: int = 0
    unseen: int = 0
    time: float = 0.0
    memory: Any = None


class Sound:
    """Follows the centroid of what is more than half as bright, or as dark, as the target was at the start."""

    resumable: ClassVar[bool] = True
    reach = 8

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        window, _, _ = cut(frame.image, box.cx, box.cy, box.w / 2 + self.reach, box.h / 2 + self.reach)
        middle, _, _ = cut(frame.image, box.cx, box.cy, box.w / 4, box.h / 4)
        contrast = float(np.median(middle) - np.median(window)) if middle.size else 0.0
        return State(box.cx, box.cy, box.w, box.h, contrast, time=frame.time)

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        window, left, top = cut(frame.image, state.x, state.y, state.w / 2 + self.reach, state.h / 2 + self.reach)
        sign = 1.0 if state.contrast > 0 else -1.0
        out = sign * (window - np.median(window)) > abs(state.contrast) / 2 if window.size else np.zeros((0, 0), bool)
        share = float(out.sum() / (state.w * state.h))
        if state.contrast == 0 or share < 0.25:
            unseen = state.unseen + 1
            after = replace(state, steps=state.steps + 1, unseen=unseen, time=frame.time)
            status: Any = "lost" if unseen > 10 else "occluded"
            return after, self.says(after, frame, Estimate((state.x, state.y), (state.w, state.h), status, score=share))
        rows, columns = np.nonzero(out)
        x, y = left + float(columns.mean()), top + float(rows.mean())
        velocity = tuple(
            0.7 * v + 0.3 * (new - old)
            for v, new, old in zip(
                state.velocity if state.steps else (x - state.x, y - state.y), (x, y), (state.x, state.y), strict=True
            )
        )
        after = replace(
            state, x=x, y=y, velocity=(velocity[0], velocity[1]), steps=state.steps + 1, unseen=0, time=frame.time
        )
        estimate = Estimate((x, y), (state.w, state.h), "tracking", share, after.velocity, 0.25 * np.eye(2))
        return after, self.says(after, frame, estimate)

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        """What it says in the end: where the planted ones differ."""
        return estimate


def cut(image: np.ndarray, cx: float, cy: float, half_w: float, half_h: float) -> tuple[Floats, int, int]:
    """(the window about a place, its first column, its first row)."""
    left, top = max(round(cx - half_w), 0), max(round(cy - half_h), 0)
    right, bottom = max(round(cx + half_w) + 1, 0), max(round(cy + half_h) + 1, 0)
    return image[top:bottom, left:right].astype(np.float64), left, top


def moved(estimate: Estimate, x: float, y: float = 0.0) -> Estimate:
    return replace(estimate, center=(estimate.center[0] + x, estimate.center[1] + y))


def lagging(estimate: Estimate, px: float) -> Estimate:
    """Behind the target: the same in a mirrored or moved picture."""
    vx, vy = estimate.velocity or (0.0, 0.0)
    speed = float(np.hypot(vx, vy))
    return moved(estimate, -px * vx / speed, -px * vy / speed) if speed > 0.2 else estimate


class Constant:
    """The start box for ever."""

    resumable: ClassVar[bool] = True

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Box:
        return box

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        return state, Estimate((state.cx, state.cy), (state.w, state.h))


class Raises(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, 1 / 0)


class Hangs(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        time.sleep(600.0 if frame.index == 4 else 0.0)
        return estimate


class Dies(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        if frame.index == 4:
            os._exit(3)
        return estimate


class Forks(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        if frame.index == 4:
            os.fork()
        return estimate


@dataclass(frozen=True)
class Killed(Sound):
    """Its process is killed in frame 4, once: then the file `once` is there."""

    once: str

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        if frame.index == 4:
            kill_once(self.once)
        return estimate


@dataclass(frozen=True)
class KilledBefore(Sound):
    """A process that it is sent to is killed before it is asked anything; where `once` names a file, as of `Killed`."""

    once: str = ""

    def __reduce__(self) -> tuple[Any, ...]:
        return _arrived, (self.once,)


def _arrived(once: str) -> KilledBefore:
    if multiprocessing.parent_process() is not None:
        kill_once(once)
    return KilledBefore(once)


def kill_once(once: str) -> None:
    if not (once and Path(once).exists()):
        if once:
            Path(once).touch()
        os.kill(os.getpid(), signal.SIGKILL)
