"""Planted trackers that follow badly, each in its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from sound_tracker import Answer, Sound, State, lagging, moved

from irsim.types import Box, Frame
from irtrack.types import Estimate


class Lags(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        honest = None if estimate.covariance is None else 4.0 * estimate.covariance
        return replace(lagging(estimate, 2.8), covariance=honest)


class Creeps(Sound):
    """Where nothing moves it goes for a walk."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        still = float(np.hypot(*state.velocity)) < 0.15
        return moved(estimate, 0.12 * state.steps) if still else estimate


class Swells(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        grown = 1.03**state.steps
        return replace(estimate, size=(estimate.size[0] * grown, estimate.size[1] * grown))


class Faithful(Sound):
    """Holds for ever three times what its start box was off."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        state = super().init(frame, box, rng)
        _, seen = Sound().step(state, frame, rng)
        off = np.subtract((box.cx, box.cy), seen.center)
        return replace(state, memory=tuple(3 * off))

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return moved(estimate, *state.memory)


class Tailored(Sound):
    """Wants a box that fits: it goes by the share of it that stands out."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> State:
        state = super().init(frame, box, rng)
        _, seen = Sound().step(state, frame, rng)
        return replace(state, memory=seen.score is not None and 0.6 < seen.score < 1.0)

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if state.memory else lagging(estimate, 7.0)


class Stutters(Sound):
    """A frame that comes again throws it off for good."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        again = bool(state.memory) or (state.steps > 0 and frame.time == state.time)
        after, estimate = super().step(replace(state, memory=again), frame, rng)
        return after, lagging(estimate, 7.0) if again else estimate


class Impatient(Sound):
    """A gap throws it off for good."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        gap = bool(state.memory) or 1.5 / 30 < frame.time - state.time < 1.0
        after, estimate = super().step(replace(state, memory=gap), frame, rng)
        return after, lagging(estimate, 7.0) if gap else estimate


class Resentful(Sound):
    """Once it was hidden it is off for good, as far as it would be anyway after a long hiding."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        after, estimate = super().step(state, frame, rng)
        off = bool(state.memory) or after.unseen > 0
        return replace(after, memory=off), lagging(estimate, 7.0) if off else estimate


class Backwards(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        vx, vy = state.velocity
        return estimate if estimate.velocity is None else replace(estimate, velocity=(-vx, -vy))
