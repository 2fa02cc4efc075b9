"""Planted trackers that say what they do not know, or do better where it is harder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from sound_tracker import Answer, Sound, State, lagging

from irsim.types import Frame
from irtrack.types import Estimate


class Timid(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, status="occluded") if estimate.status == "tracking" else estimate


class Proud(Sound):
    """Says that it sees what was hidden for a while; of what is gone for good, or of nothing at all, it does not."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        even = frame.image.min() == frame.image.max()
        return replace(estimate, status="tracking") if 0 < state.unseen < 14 and not even else estimate


class Stubborn(Sound):
    """Takes heart after a while."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, status="tracking") if state.unseen > 15 and frame.image.std() > 0 else estimate


class Ghosts(Sound):
    """Sees what it looks for in a picture of nothing."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, status="tracking") if frame.image.std() == 0 else estimate


class Inverted(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return replace(estimate, score=-float(estimate.score or 0.0))


class Certain(Sound):
    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        return estimate if estimate.covariance is None else replace(estimate, covariance=np.zeros((2, 2)))


class LovesNoise(Sound):
    """Better in noise, of which it knows by the share of the contrast."""

    def says(self, state: State, frame: Frame, estimate: Estimate) -> Estimate:
        spread = np.subtract(*np.percentile(frame.image.astype(np.float64), [75, 25]))
        return lagging(estimate, 1.5) if spread < 0.06 * abs(state.contrast) else estimate


class LovesHiding(Sound):
    """Better for having been hidden."""

    def step(self, state: State, frame: Frame, rng: np.random.Generator) -> Answer:
        after, estimate = super().step(state, frame, rng)
        wiser = bool(state.memory) or after.unseen > 6
        return replace(after, memory=wiser), estimate if wiser else lagging(estimate, 1.5)
