"""`matched_filter_ideal`: the largest possible probability of detection on a rendered scene, a row beside those of
detectors.

It needs the truth: a ceiling, not a detector. Detections on a target lie in a disc of area A (`irtrack.metrics.
detection`). Where a detector has `rate` false alarms in a frame of N pixels, evenly spread, at most the share Pfa =
rate A / N of such discs without a target holds a detection; no test of that Pfa finds more than Pd = Q(Q^-1(Pfa) - d)
(`irsim.Detectability`). It bounds a detector that sees one frame at a time, where clutter is normal and stationary over
the frame; a difference of frames may lie above it in clutter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import ClassVar

import numpy as np
from scipy.special import ndtr, ndtri

import irsim
from irsim.types import Floats, Truth
from irtrack.metrics.detection import DETECTION_FIGURES, RATES, is_to_be_found, radius

CEILING = "matched_filter_ideal"
"""Label of the row."""
NEEDS_TRUTH = f"{CEILING} needs truth: a ceiling, not a detector"
MOST_FRAMES = 30
"""Frames of a run, evenly spaced, in which d^2 is computed: it takes longer than a detector."""


@dataclass(frozen=True)
class IdealMatchedFilter:
    """The ceiling as a member of a bench; without parameters."""

    task: ClassVar[str] = "detect"


@dataclass(frozen=True, eq=False)
class Ceiling:
    """d^2 (t,) of each target that is to be found in a frame, and the share (t,) of the frame's area that counts as on
    it."""

    d2: Floats
    share: Floats

    @classmethod
    def of(cls, scenario: irsim.Scenario, truths: Sequence[Truth]) -> Ceiling:
        """Return the ceiling of a rendered scenario in at most `MOST_FRAMES` of its frames, by their ground truth.

        InputError for a recorded background, whose noise is unknown.
        """
        detectability, (columns, rows) = irsim.Detectability(scenario), scenario.camera.size
        found = [
            (detectability.d2(truth.index, each.id), pi * radius(each) ** 2 / (columns * rows))
            for truth in truths[:: -(-len(truths) // MOST_FRAMES) or 1]
            for each in truth.targets
            if is_to_be_found(each)
        ]
        table = np.array(found, dtype=np.float64).reshape(-1, 2)
        return cls(table[:, 0], table[:, 1])

    def pd_at(self, rates: Floats) -> Floats:
        """Return the largest mean probability of detection at false alarms a frame (p,); nan without a target."""
        if not len(self.d2):
            return np.full(len(rates), np.nan)
        pfa = np.minimum(np.asarray(rates)[:, None] * self.share, 1.0)
        return np.asarray(ndtr(np.sqrt(self.d2) + ndtri(pfa)).mean(axis=1))

    def figures(self) -> dict[str, float | None]:
        """Return the figures of the task detect; those that need one threshold are None."""
        values = dict(zip(("pd_001", "pd_01", "pd_1", "pd_10"), self.pd_at(np.array(RATES)).tolist(), strict=True))
        return {name: value if (value := values.get(name, np.nan)) == value else None for name in DETECTION_FIGURES}


def has_ceiling(source: irsim.Source | object) -> bool:
    """Return whether a source is a rendered scenario with targets, whose noise is known."""
    scenario = source.scenario if isinstance(source, irsim.Rendering) else None
    return scenario is not None and bool(scenario.targets) and not scenario.background.has_noise
