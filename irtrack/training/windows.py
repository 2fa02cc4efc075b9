"""Positive and negative windows around targets and in backgrounds, at the scale at which a classifier sees them.

A window stands for a box: the target that it would frame. It is negative where the box overlaps no target by more than
`MOST_OVERLAP`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from irsim.rng import stream
from irsim.types import Bools, Box, Floats
from irtrack.features.scaled_region import ScaledRegion
from irtrack.features.window import overlaps
from irtrack.training.frames import LabelledFrame, box_of

MOST_OVERLAP = 0.4
"""Largest IoU of a negative window's box with a target's."""
REACH = 2.5
"""Half side of the part of a frame around a target, in sides of its box."""
JITTER, SCALE_JITTER, ASPECT_JITTER = 0.05, 0.08, 0.15
"""Standard deviations of the offsets of positive windows, in sides of the box, and of the logarithms of their size and
of each side: a target that turns has another shape than the window of its track."""
POSITIVES, NEGATIVES, BACKGROUNDS = 6, 8, 6
"""Windows of each target, around each target, and in the background of each target's frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Part of a frame, and boxes (n, 4) in it: cx, cy, w, h px of the frame; `positive` (n,).

    unit    (w, h) px of the target or, in the background, of the target of the frame
    boxes   (k, 4) of the frame's targets
    cold    True where the target is darker than its surroundings
    cls     class of the target
    """

    region: ScaledRegion
    unit: Floats
    given: Floats
    positive: Bools
    boxes: Floats
    cold: bool
    cls: str | None

    def negative(self, boxes: Floats) -> Bools:
        """Return which of boxes (n, 4) overlap no target."""
        apart: Bools = overlaps(boxes, self.boxes).max(axis=1, initial=0) <= MOST_OVERLAP
        return apart

    def grid(self, stride: float, scales: Iterable[float]) -> Floats:
        """Return boxes (n, 4) at every `stride` sides across the part, of the target's size times scales."""
        rows, columns = self.region.pixels.shape
        low = self.region.centers(np.array([[0.0, 0.0]]))[0] + self.unit
        high = self.region.centers(np.array([[columns - 1.0, rows - 1.0]]))[0] - self.unit
        x, y = (np.arange(a, b, stride * u) for a, b, u in zip(low, high, self.unit, strict=True))
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return np.concatenate([np.column_stack([places, np.tile(self.unit * s, (len(places), 1))]) for s in scales])


def windows_of(frames: Iterable[LabelledFrame], standard: tuple[int, int]) -> Iterator[Windows]:
    """Yield windows around each clear target and in its frame's background; a target's box has `standard` pixels."""
    for frame in frames:
        rows, columns = frame.image.shape
        boxes = np.array([_row(box_of(target)) for target in frame.targets]).reshape(-1, 4)
        for number, target in enumerate(frame.examples()):
            rng = stream(frame.seed, "training", frame.scenario, frame.index, number)
            row, cold = np.array(_row(box_of(target))), (target.scr or 0) < 0
            unit = row[2:]
            background = rng.uniform((0, 0), (columns, rows))
            for center, own in ((row[:2], True), (background, False)):
                near = np.column_stack(_around(center, unit, NEGATIVES if own else BACKGROUNDS, rng))
                if own:
                    offsets = JITTER * unit * rng.standard_normal((POSITIVES, 2))
                    sides = SCALE_JITTER * rng.standard_normal((POSITIVES, 1))
                    sizes = unit * np.exp(sides + ASPECT_JITTER * rng.standard_normal((POSITIVES, 2)))
                    near = np.concatenate([np.column_stack([center + offsets, sizes]), near])
                positive = np.arange(len(near)) < (POSITIVES if own else 0)
                kept = positive | (overlaps(near, boxes).max(axis=1, initial=0) <= MOST_OVERLAP)
                step = unit / np.array(standard)
                region = ScaledRegion.of(frame.image, center - REACH * unit, center + REACH * unit, step)
                yield Windows(region, unit, near[kept], positive[kept], boxes, cold, target.cls)


def _around(center: Floats, unit: Floats, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return centres (n, 2) up to 1.5 sides from a place, half of them near, and sizes (n, 2) about the unit."""
    reach = np.where(np.arange(count) % 2 == 0, 0.7, 1.5)[:, None]
    centers = center + reach * unit * rng.uniform(-1, 1, (count, 2))
    return centers, unit * np.exp(0.4 * rng.uniform(-1, 1, (count, 1)))


def _row(box: Box) -> tuple[float, float, float, float]:
    return box.cx, box.cy, box.w, box.h
