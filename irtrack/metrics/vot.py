"""Accuracy, robustness and expected average overlap by anchors, as in the VOT challenge.

A tracker is started in several frames of a sequence (anchors) and runs from each to the sequence's end or,
backwards, to its beginning. Kristan et al., "The eighth visual object tracking VOT2020 challenge results",
ECCV Workshops 2020, section 3; details as in vot-toolkit 0.9 (analysis/multistart.py), which these figures follow:

A run fails where ten successive frames have an overlap of 0.1 or less; the failure is the first of the ten. A frame
without a target ends the sequence of low overlaps. The progress of a run is its number of frames before the failure.
The progress includes the start frame, with an overlap of 0, so that the accuracy of a perfect tracker is below 1 and
below its EAO. The toolkit's "burn-in" of 10 frames excludes no frame in this mode: it only clips boxes to the image
before they are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import irsim
from irsim.types import Floats, Frame, Input, Source, Truth
from irtrack.errors import whole_number
from irtrack.metrics.trace import Reference, Trace
from irtrack.replay.replay import Player, named
from irtrack.replay.start import Start, find_start, shows
from irtrack.types import GivenTracker, Tracker

FAILED = 0.1
"""Largest overlap in a frame that counts towards a failure."""
GRACE = 10
"""Number of successive frames with at most this overlap that make a failure."""


@dataclass(frozen=True, slots=True, eq=False)
class AnchorRun:
    """Run from one anchor: overlap (n,) 0..1 of each frame, and True where the target was present (n,).

    The first frame is the start, whose overlap is not used.
    """

    overlap: Floats
    present: np.ndarray

    @property
    def progress(self) -> int:
        """Number of frames before the failure; n without a failure."""
        row = 0
        # As in the toolkit the overlap of the start frame is taken as 0, so it counts towards a failure.
        for position, bad in enumerate(((self.overlap <= FAILED) & self.present).tolist()):
            row = row + 1 if bad or position == 0 else 0
            if row == GRACE:
                return position + 1 - GRACE
        return len(self.overlap)

    @property
    def held(self) -> Floats:
        """Overlap (n,), set to 0 in the start frame and from the failure on."""
        kept = self.overlap.copy()
        kept[0] = 0.0
        kept[self.progress :] = 0.0
        return kept


@dataclass(frozen=True, slots=True)
class Vot:
    """VOT metrics, 0..1: mean overlap before failures, share of frames before failures, expected average overlap."""

    accuracy: float
    robustness: float
    eao: float


def vot(sequences: Sequence[Sequence[AnchorRun]], lengths: Sequence[int], low: int, high: int) -> Vot:
    """Return the VOT metrics over sequences; `sequences`: runs of each; `lengths`: number of frames of each.

    low, high   bounds of the sequence length, frames, over which the expected average overlap is averaged (VOT takes
                the interval that contains half of its sequences; publish the bounds with the result)
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
    """Return the expected average overlap of sequences of 0 .. high - 1 frames after the start, (high,).

    At each length it is the mean over runs at least as long, and over failed runs, whose overlap is 0 from the failure
    on. A run that ends without failure does not enter at greater lengths. The overlap is 0 at lengths without runs.
    """
    totals, counts = np.zeros(high), np.zeros(high)
    lengths = np.arange(1, high)
    for run in runs:
        held = run.held[1:]
        sums = np.concatenate([np.cumsum(held)[: high - 1], np.full(max(high - 1 - len(held), 0), held.sum())])
        within = lengths <= len(held)
        # Beyond the end of a run the toolkit divides by one frame less.
        means = sums / np.where(within, lengths, np.maximum(lengths - 1, 1))
        counted = within | (run.progress < len(run.overlap))
        totals[1:] += np.where(counted, means, 0.0)
        counts[1:] += counted
    return np.divide(totals, counts, out=np.zeros(high), where=counts > 0)


EVERY = 50
"""Number of frames from anchor to anchor (Kristan et al., VOT2020, section 3.1)."""


def run_anchors(
    tracker: str | GivenTracker,
    source: str | Path | irsim.Scenario | Source,
    *,
    target: str | None = None,
    input: Input = "display",
    seed: int = 0,
    every: int = EVERY,
) -> list[AnchorRun]:
    """Run a tracker from each anchor of a source to the farther end; return the runs, for `irtrack.metrics.vot`.

    Anchors are the frames 0, `every`, 2 `every`, ... and the last frame. An anchor in which less than half of the
    target is visible moves to the next frame with at least half visible; without a later frame of this kind it is left
    out. The tracker runs forwards from anchors in the first half of the source and backwards from the others; in each
    run its frames are numbered from 0.

    target, input, seed   as in `irtrack.run`. InputError for wrong input, TrackerError for an error of the tracker.
    """
    step = whole_number("every", every, least=1)
    chosen, opened = named(tracker), irsim.open_source(source)
    truths = list(opened.truths())
    followed = find_start(opened, truths, target).target
    return [
        _run(chosen, opened, truths, followed, order, input, whole_number("seed", seed))
        for order in orders(truths, followed, step)
    ]


def orders(truths: Sequence[Truth], target: str | None, every: int = EVERY) -> list[range]:
    """Return for each anchor the indices of the frames of its run, in the order in which the tracker gets them."""
    shown = [k for k, truth in enumerate(truths) if any(seen.id == target and shows(seen) for seen in truth.targets)]
    last = len(truths) - 1
    wanted = [*range(0, last, every), last]
    anchors = sorted({next(k for k in shown if k >= anchor) for anchor in wanted if shown and anchor <= shown[-1]})
    return [range(k, last + 1) if 2 * k < last else range(k, -1, -1) for k in anchors]


def _run(
    tracker: Tracker, source: Source, truths: Sequence[Truth], target: str | None, order: range, input: Input, seed: int
) -> AnchorRun:
    ordered = [Truth(k, k / source.rate_hz, truths[index].targets) for k, index in enumerate(order)]
    box = find_start(source, ordered[:1], target).box
    player = Player(tracker, Start(target, 0, box), seed)
    for k, index in enumerate(order):
        frame = source.frame(index, input)
        player.see(Frame(frame.image, k, k / source.rate_hz, frame.bits, truths[index].pose))
    trace = Trace.of(player.track(source, input), Reference.of(ordered, target))
    return AnchorRun(np.nan_to_num(trace.overlaps), trace.truth.present)
