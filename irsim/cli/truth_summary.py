"""Ground truth of each target summarised over all frames: size, speed, SCR, and when it is hidden or out of view."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby
from math import hypot
from typing import Literal

import numpy as np

from irsim.types import Box, TargetTruth, Truth

NoScr = Literal["hidden", "outside", "unknown"]
"""Reason why a target has no signal-to-clutter ratio. hidden: in every frame that contains the target's centre, more
than half of the target is hidden or cut off by the edge. outside: its centre is never in the picture. unknown: the
truth has no ratio."""


@dataclass(frozen=True)
class FrameSpan:
    """Frames from first to last, both included, and the names of occluders in any of them."""

    first: int
    last: int
    occluders: tuple[str, ...] = ()


@dataclass(frozen=True)
class TargetSummary:
    """Truth of one target over all frames in which it exists.

    frames    number of frames in which it exists; `first` is the first of them
    size      median width and height of its box, px
    speed     median apparent speed, px per frame; None where the truth has no velocity
    scr       5 %, 50 % and 95 % quantiles of its signal-to-clutter ratio in frames where it is not hidden, or None
    no_scr    reason why `scr` is None
    hidden    spans in which its centre is in the picture and less than half of it is visible
    cut       like `hidden`, but only where there is no occluder and its box reaches past the picture's edge
    outside   spans in which its centre is out of the picture
    crossing  spans in which its box overlaps another target's box
    absent    spans in which it does not exist
    """

    id: str
    cls: str | None
    frames: int
    first: int
    size: tuple[float, float]
    speed: float | None
    scr: tuple[float, float, float] | None
    no_scr: NoScr | None
    hidden: tuple[FrameSpan, ...]
    cut: tuple[FrameSpan, ...]
    outside: tuple[FrameSpan, ...]
    crossing: tuple[FrameSpan, ...]
    absent: tuple[FrameSpan, ...]


def summarize(truths: Iterable[Truth], size: tuple[int, int]) -> list[TargetSummary]:
    """Return a summary of each target, in the order of their first frames.

    size  (columns, rows) of the frames, px
    """
    frames: list[int] = []
    by_target: dict[str, dict[int, TargetTruth]] = {}
    for truth in truths:
        frames.append(truth.index)
        for target in truth.targets:
            by_target.setdefault(target.id, {})[truth.index] = target
    return [_summary(by_frame, frames, size) for by_frame in by_target.values()]


def _summary(by_frame: dict[int, TargetTruth], frames: list[int], size: tuple[int, int]) -> TargetSummary:
    targets = list(by_frame.values())
    speeds = [hypot(*target.velocity) for target in targets if target.velocity is not None]
    ratios = [target.scr for target in targets if target.scr is not None and not target.hidden]
    outside = {index: () for index, target in by_frame.items() if target.in_view is False}
    hidden = {index: target for index, target in by_frame.items() if target.hidden and index not in outside}
    cut = {index: () for index, target in hidden.items() if not target.occluders and _crosses_edge(target.box, size)}
    return TargetSummary(
        id=targets[0].id,
        cls=targets[0].cls,
        frames=len(by_frame),
        first=next(iter(by_frame)),
        size=(_median([target.box.w for target in targets]), _median([target.box.h for target in targets])),
        speed=_median(speeds) if speeds else None,
        scr=tuple(np.quantile(ratios, (0.05, 0.5, 0.95)).tolist()) if ratios else None,
        no_scr=None if ratios else _no_scr(targets),
        hidden=_spans({index: target.occluders for index, target in hidden.items() if index not in cut}),
        cut=_spans(cut),
        outside=_spans(outside),
        crossing=_spans({index: () for index, target in by_frame.items() if target.crossing}),
        absent=_spans({index: () for index in frames if index not in by_frame}),
    )


def _no_scr(targets: Sequence[TargetTruth]) -> NoScr:
    in_view = [target for target in targets if target.in_view is not False]
    if not in_view:
        return "outside"
    return "hidden" if all(target.hidden for target in in_view) else "unknown"


def _crosses_edge(box: Box, size: tuple[int, int]) -> bool:
    """Return True if a box reaches past the edges of a frame of `size` (columns, rows)."""
    return min(box.left, box.top) < -0.5 or box.right > size[0] - 0.5 or box.bottom > size[1] - 0.5


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _spans(occluders: Mapping[int, tuple[str, ...]]) -> tuple[FrameSpan, ...]:
    """Return the runs of consecutive frames, each with the names of all occluders in it."""
    spans = []
    for _, run in groupby(enumerate(occluders), lambda item: item[1] - item[0]):
        frames = [frame for _, frame in run]
        names = dict.fromkeys(chain(*(occluders[frame] for frame in frames)))
        spans.append(FrameSpan(frames[0], frames[-1], tuple(names)))
    return tuple(spans)
