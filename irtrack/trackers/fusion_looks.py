"""Where `fusion_wspf` looks, and what it finds there: at a place, where mean shift rests, in the whole frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Box, Floats, Image
from irtrack.features.cues import Cue, Field, Pattern, likeness_map
from irtrack.features.mean_shift import bandwidth, mean_shift
from irtrack.features.quantise import Quantiser
from irtrack.features.window import Window
from irtrack.trackers.base import Footage, Sight

RING_PX = 10
"""Width of the ring that stands for the background (Li, Li 2014, section 4.1: ten pixels outside the window)."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """What the first frame sets for good. rival: the best fused rho away from the target in that frame."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    pattern: Pattern
    quantiser: Quantiser
    rival: float


@dataclass(frozen=True, slots=True, eq=False)
class FusionState:
    """model: q of both cues; confidence: (L_y, L_d) of grey and gradient, summing to one;
    particles (N, 6): x, y px, vx, vy px/frame, size in start sizes; weights (N,)."""

    start: Start
    model: Cue
    confidence: Floats
    particles: Floats
    weights: Floats
    sight: Sight


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """How a state (6,) looks in a frame: its cues, their rho (2,), fused rho, cues of the ring, its fused rho."""

    state: Floats
    cue: Cue
    rho: Floats
    fused: float
    ring: Cue
    floor: float


def field_of(state: FusionState, image: Image) -> Field:
    """A frame, as its cues are counted."""
    return Field(image, state.start.quantiser, len(state.model.gradient))


def look_at(state: FusionState, field: Field, at: Floats) -> Look:
    """How the place, speed and size `at` (6,) look beside the model."""
    cues, visible = field.windows(state.start.pattern, at[None, :2], at[None, 4:])
    cue = cues.of(0)
    width, height = state.start.size
    ring = field.ring((at[0], at[1], at[4] * width, at[5] * height), RING_PX)
    rho = np.array(cue.like(state.model)) * visible[0]
    return Look(at, cue, rho, float(state.confidence @ rho), ring, float(state.confidence @ ring.like(state.model)))


def shifted(state: FusionState, image: Image, at: Floats, widening: float) -> Look:
    """Where mean shift comes to rest from `at` (6,), its bandwidth `widening` times the target's (section 4.2)."""
    width, height = state.start.size
    h = bandwidth(Box(at[0], at[1], at[4] * width, at[5] * height), widening)
    rest = mean_shift(image, at[None, :2], h, state.start.quantiser, state.model.grey)
    there = np.concatenate([rest.centers[0], at[2:]])
    return look_at(state, field_of(state, image), there)


def best_of_frame(state: FusionState, image: Image, speed: Floats) -> Look | None:
    """The place in the whole frame that is most like the model, at the first size and that speed (2,).

    None where no window fits into the frame.
    """
    start = state.start
    field = field_of(state, image)
    fused = np.tensordot(state.confidence, likeness_map(field, start.window, start.pattern, state.model), 1)
    if fused.size == 0:
        return None
    row, column = np.unravel_index(int(fused.argmax()), fused.shape)
    return look_at(state, field, np.array([*start.window.center((float(column), float(row))), *speed, 1.0, 1.0]))
