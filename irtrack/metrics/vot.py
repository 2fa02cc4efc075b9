"""Accuracy, robustness and expected average overlap by anchors, as the VOT challenge counts them.

A tracker is started in several frames of a sequence (anchors) and runs from each to the sequence's end or,
backwards, to its beginning. Kristan et al., "The eighth visual object tracking VOT2020 challenge results",
ECCV Workshops 2020, section 3; details as in vot-toolkit 0.9 (analysis/multistart.py), which these figures follow:

A run fails where ten frames in a row have an overlap of 0.1 or less; the failure is the first of the ten. A
frame without a target counts as a good one: after it the ten are counted anew. The progress of a run is its
number of frames before the failure. It includes the start frame, with an overlap of 0; therefore a perfect
tracker has an accuracy below 1, and below its EAO. The toolkit also has a "burn-in" of 10 frames, but in this
mode it leaves no frame out: it only has boxes cut to the picture before they are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irsim.types import Floats

FAILED = 0.1
"""Overlap up to which a frame is a bad one."""
GRACE = 10
"""Bad frames in a row that make a failure."""


@dataclass(frozen=True, slots=True, eq=False)
class AnchorRun:
    """A run from one anchor: overlap (n,) 0..1 of each frame, and whether there was a target in it (n,) bool.

    The first frame is the start, whose overlap is not used.
    """

    overlap: Floats
    present: np.ndarray

    @property
    def progress(self) -> int:
        """Frames before the failure; all n where there is none."""
        row = 0
        # As in the toolkit the start counts as a bad frame: its overlap is taken as 0.
        for position, bad in enumerate(((self.overlap <= FAILED) & self.present).tolist()):
            row = row + 1 if bad or position == 0 else 0
            if row == GRACE:
                return position + 1 - GRACE
        return len(self.overlap)

    @property
    def held(self) -> Floats:
        """(n,) overlap, 0 in the start frame and from the failure on."""
        kept = self.overlap.copy()
        kept[0] = 0.0
        kept[self.progress :] = 0.0
        return kept


@dataclass(frozen=True, slots=True)
class Vot:
    """accuracy: mean overlap before failures; robustness: share of frames before failures; eao; all 0..1."""

    accuracy: float
    robustness: float
    eao: float


def vot(sequences: Sequence[Sequence[AnchorRun]], lengths: Sequence[int], low: int, high: int) -> Vot:
    """The figures over sequences, each with its runs and its length in frames.

    low, high   lengths, frames, over which the curve of the expected average overlap is averaged (VOT takes
                what holds half of its sequences' lengths; there is no such set here: say which you took)
    """
    progress = np.array([sum(run.progress for run in runs) for runs in sequences], dtype=np.float64)
    frames = np.array([sum(len(run.overlap) for run in runs) for runs in sequences], dtype=np.float64)
    sums = np.array([sum(run.held.sum() for run in runs) for runs in sequences])
    weights = np.asarray(lengths, dtype=np.float64)
    accuracy = float(sums.sum() / progress.sum()) if progress.sum() else 0.0
    robustness = float((progress / frames * weights).sum() / weights.sum())
    curve = expected_overlap([run for runs in sequences for run in runs], high)
    return Vot(accuracy, robustness, float(np.mean(curve[low : high + 1])))


def expected_overlap(runs: Sequence[AnchorRun], high: int) -> Floats:
    """(high,) the expected average overlap of sequences 0 .. high - 1 frames long after the start.

    At each length the mean over the runs that are longer, and over those that failed, taken as zero
    for ever after; a run that ends without failure says nothing about longer ones. 0 where no run does.
    """
    totals, counts = np.zeros(high), np.zeros(high)
    lengths = np.arange(1, high)
    for run in runs:
        told = run.held[1:]
        sums = np.concatenate([np.cumsum(told)[: high - 1], np.full(max(high - 1 - len(told), 0), told.sum())])
        within = lengths <= len(told)
        # Beyond the run's end the toolkit divides by one frame less.
        means = sums / np.where(within, lengths, np.maximum(lengths - 1, 1))
        counted = within | (run.progress < len(run.overlap))
        totals[1:] += np.where(counted, means, 0.0)
        counts[1:] += counted
    return np.divide(totals, counts, out=np.zeros(high), where=counts > 0)
