"""What truth says of each target over all frames: how large, how fast, how clear, and when it is not seen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby
from math import hypot
from typing import Literal

import numpy as np

from irsim.types import Box, TargetTruth, Truth

WhyNone = Literal["hidden", "outside", "unknown"]
"""Why a target has no signal-to-clutter ratio: less than half of it is seen in all frames that have its centre, be
it for the picture's edge; its centre is never in the picture; or truth does not know."""


@dataclass(frozen=True)
class Spell:
    """Frames first .. last, both counted, and the names of what hid the target in any of them."""

    first: int
    last: int
    by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Survey:
    """One target over all frames in which it is.

    frames    how many these are; first is the first of them
    size      median width and height of its box, px
    speed     median apparent speed, px per frame; None where truth does not know
    scr       5 %, 50 % and 95 % of its signal-to-clutter ratio while it is seen; None where there is none
    why_none  one word for why there is none, where that is so
    hidden    spells in which its centre is in the picture, yet less than half of it is seen
    cut       such spells in which nothing is known to hide it but the picture's edge
    outside   spells in which its centre is out of the picture
    crossing  spells in which its box meets another target's
    absent    spells in which it is not there
    """

    id: str
    cls: str | None
    frames: int
    first: int
    size: tuple[float, float]
    speed: float | None
    scr: tuple[float, float, float] | None
    why_none: WhyNone | None
    hidden: tuple[Spell, ...]
    cut: tuple[Spell, ...]
    outside: tuple[Spell, ...]
    crossing: tuple[Spell, ...]
    absent: tuple[Spell, ...]


def survey(truths: Iterable[Truth], size: tuple[int, int]) -> list[Survey]:
    """Of each target that the truths name, in the order in which they first do.

    size  (columns, rows) of the frames
    """
    frames: list[int] = []
    rows: dict[str, dict[int, TargetTruth]] = {}
    for truth in truths:
        frames.append(truth.index)
        for target in truth.targets:
            rows.setdefault(target.id, {})[truth.index] = target
    return [_of(row, frames, size) for row in rows.values()]


def _of(row: dict[int, TargetTruth], frames: list[int], size: tuple[int, int]) -> Survey:
    targets = list(row.values())
    speeds = [hypot(*target.velocity) for target in targets if target.velocity is not None]
    ratios = [target.scr for target in targets if target.scr is not None and not target.hidden]
    outside = {index: () for index, target in row.items() if target.in_view is False}
    unseen = {index: target for index, target in row.items() if target.hidden and index not in outside}
    cut = {index: () for index, target in unseen.items() if not target.occluders and _leaves(target.box, size)}
    hidden = {index: target.occluders for index, target in unseen.items() if index not in cut}
    return Survey(
        id=targets[0].id,
        cls=targets[0].cls,
        frames=len(row),
        first=next(iter(row)),
        size=(_median([target.box.w for target in targets]), _median([target.box.h for target in targets])),
        speed=_median(speeds) if speeds else None,
        scr=tuple(np.quantile(ratios, (0.05, 0.5, 0.95)).tolist()) if ratios else None,
        why_none=None if ratios else _why_none(targets),
        hidden=_spells(hidden),
        cut=_spells(cut),
        outside=_spells(outside),
        crossing=_spells({index: () for index, target in row.items() if target.crossing}),
        absent=_spells({index: () for index in frames if index not in row}),
    )


def _why_none(targets: Sequence[TargetTruth]) -> WhyNone:
    """Why a target has no ratio in any frame in which it is seen."""
    inside = [target for target in targets if target.in_view is not False]
    if not inside:
        return "outside"
    return "hidden" if all(target.hidden for target in inside) else "unknown"


def _leaves(box: Box, size: tuple[int, int]) -> bool:
    """Does a box reach past the edges of frames of (columns, rows)?"""
    return min(box.left, box.top) < -0.5 or box.right > size[0] - 0.5 or box.bottom > size[1] - 0.5


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _spells(names: Mapping[int, tuple[str, ...]]) -> tuple[Spell, ...]:
    """Runs of neighbouring frames, with all names that any of them has."""
    spells = []
    for _, run in groupby(enumerate(names), lambda item: item[1] - item[0]):
        frames = [frame for _, frame in run]
        spells.append(Spell(frames[0], frames[-1], tuple(dict.fromkeys(chain(*(names[frame] for frame in frames))))))
    return tuple(spells)
