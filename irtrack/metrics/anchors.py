"""Runs from anchors, forwards and backwards, as the VOT challenge starts trackers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import irsim
from irsim.types import Frame, Input, Source, Truth
from irtrack.errors import whole_number
from irtrack.metrics import AnchorRun, Reference, Trace
from irtrack.replay.replay import Player, named
from irtrack.replay.start import Start, find_start, shows
from irtrack.types import GivenTracker, Tracker

EVERY = 50
"""Frames between anchors (Kristan et al., VOT2020, section 3.1)."""


def run_anchors(
    tracker: str | GivenTracker,
    source: str | Path | irsim.Scenario | Source,
    *,
    target: str | None = None,
    input: Input = "display",
    seed: int = 0,
    every: int = EVERY,
) -> list[AnchorRun]:
    """Start a tracker in each anchor of a source and run it to the farther end, for `irtrack.metrics.vot`.

    Anchors are frames 0, every, 2 every ... and the last; one in which less than half of the target
    shows moves to the nearest later frame in which it does, or is left out. A tracker runs forwards from
    anchors of the first half and backwards from the others; it sees frames counted from 0 on.

    target, input, seed   as in `irtrack.run`. InputError for bad input, TrackerError for what the tracker raises.
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
    """The frames of each run, in the order in which the tracker sees them."""
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
        player.see(Frame(frame.image, k, k / source.rate_hz, frame.bits))
    trace = Trace.of(player.track(source, input), Reference.of(ordered, target))
    return AnchorRun(np.nan_to_num(trace.overlaps), trace.truth.present)
