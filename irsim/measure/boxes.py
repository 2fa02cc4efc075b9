"""Where truth has targets: pixels that tell of neither noise nor texture."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import numpy as np

from irsim.measure.region import Region
from irsim.types import Bools, Box, Source

BESIDE_PX = 4
"""Blur and smear reach so far beyond a target's box."""
Boxes = tuple[tuple[Region, ...], ...]
"""Of each frame, where its targets are; they may reach beyond the lower and right edge."""


def boxes_of_targets(source: Source, start: int, stop: int) -> Boxes | None:
    """Where truth has targets in each of the frames start .. stop-1; None where there is no truth."""
    if not source.has_truth:
        return None
    return tuple(tuple(_beside(target.box) for target in truth.targets) for truth in source.truths(start, stop))


def _beside(box: Box) -> Region:
    """The pixels that blur and smear of a target reach."""
    left, high = (max(int(np.floor(edge - BESIDE_PX)), 0) for edge in (box.left, box.top))
    right, low = (max(int(np.ceil(edge + BESIDE_PX)) + 1, 0) for edge in (box.right, box.bottom))
    return Region(left, high, right - left, low - high)


def covered(boxes: Iterable[Region], shape: tuple[int, ...]) -> Bools:
    """(rows, columns): which pixels of a picture of that shape lie in one of the boxes."""
    taken = np.zeros(shape, np.bool_)
    for box in boxes:
        taken[box.rows, box.columns] = True
    return taken


def taken_by_targets(source: Source, start: int, stop: int) -> Bools | None:
    """(rows, columns): where truth has a target in any of the frames start .. stop-1; None where there is no truth."""
    boxes = boxes_of_targets(source, start, stop)
    return None if boxes is None else covered(itertools.chain(*boxes), source.size[::-1])
