"""Planted trackers that break what their contract says."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from sound_tracker import Answer, Sound, State, moved

from irsim.types import Box, Frame
from irtrack.types import Estimate

TINY = 1e-9
"""px: far below any tolerance, yet another number."""


class Illegal(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return (
            moved(estimate, float("nan"))
            if frame.image.min() == frame.image.max() and frame.image.size < 2400
            else estimate
        )


COUNTER = itertools.count()


class Random(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, TINY * next(COUNTER))


class Hashes(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, TINY * (hash("target") % 100_003))


class Peeks(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        whole = frame.image.base
        return estimate if whole is None or whole.ndim != 3 else moved(estimate, TINY * float(whole[-1, 0, 0]))


class Rewrites(Sound):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        return replace(super().init(frame, box, rng), memory=np.zeros((2, 2)))

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        state.memory[:] = estimate.center
        return replace(estimate, particles=state.memory)


class Counts(Sound):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        return replace(super().init(frame, box, rng), memory=[0])

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        state.memory[0] += 1
        return moved(estimate, TINY * state.memory[0])


class Cache:
    """Does not survive being pickled."""

    warm = True

    def __reduce__(self) -> tuple[Any, ...]:
        return Cold, ()


class Cold(Cache):
    warm = False


class Forgets(Sound):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        return replace(super().init(frame, box, rng), memory=Cache())

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if state.memory.warm else moved(estimate, TINY)


class Shares(Sound):
    begun = 0.0

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        self.begun = box.cx
        return super().init(frame, box, rng)

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, TINY * self.begun)


class Scribbles(Sound):
    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        answer = super().step(state, frame, rng)
        if frame.image.flags.writeable:
            frame.image[0, 0] = 0
        return answer


class Contiguous(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if frame.image.flags.c_contiguous else moved(estimate, 1.0)


class Clock(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, 1.0) if frame.time > 1000 else estimate


class Hoards(Sound):
    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        after, estimate = super().step(state, frame, rng)
        return replace(after, memory=[*(state.memory or []), frame.image.tobytes()]), estimate
