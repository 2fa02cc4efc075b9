"""The part of a picture where only noise is seen."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError
from irsim.types import Bools, Box, Floats, Source

Values = npt.NDArray[np.floating] | npt.NDArray[np.integer] | npt.NDArray[np.integer | np.floating]
"""Counts as they come, or in any unit."""

SIDE = 64
LEAST_SIDE = 4
_LOOKED_AT = 24
_SPOILT = 0.02
_LEAST_HALF = 16
"""Windows are not halved below this many px a side: in fewer pixels slow motion does not show beside chance."""
_TRIES = 8
"""Windows of each size that are offered."""
_ALIKE = 4.0
"""Standard errors within which windows' variances say nothing of which is the flatter one."""
BESIDE_PX = 4
"""Blur and smear reach so far beyond a target's box."""


class Region(NamedTuple):
    """Whole pixels x .. x+w-1, y .. y+h-1."""

    x: int
    y: int
    w: int
    h: int

    @property
    def rows(self) -> slice:
        return slice(self.y, self.y + self.h)

    @property
    def columns(self) -> slice:
        return slice(self.x, self.x + self.w)

    def of(self, frames: Values) -> Values:
        """That part of frames (..., rows, columns)."""
        return frames[..., self.rows, self.columns]

    def __str__(self) -> str:
        return f"{self.x},{self.y},{self.w},{self.h}"


def parse_region(text: str, size: tuple[int, int]) -> Region:
    """'x,y,w,h' within a picture of size (columns, rows); InputError where it is not."""
    words = text.split(",")
    if len(words) != 4 or not all(word.strip().isdecimal() for word in words):
        raise InputError(f"region {text!r}: is no region; {_allowed(size)}")
    region = Region(*(int(word) for word in words))
    check_region(region, repr(text), size)
    return region


def check_region(region: Region, shown: str, size: tuple[int, int]) -> None:
    """InputError for a region, `shown` as it was given, that is not within a picture of size (columns, rows) or is
    smaller than can be measured."""
    columns, rows = size
    inside = 0 <= region.x <= columns - region.w and 0 <= region.y <= rows - region.h
    if not inside or min(region.w, region.h) < LEAST_SIDE:
        raise InputError(f"region {shown}: does not fit; {_allowed(size)}")


def _allowed(size: tuple[int, int]) -> str:
    return f"allowed: x,y,w,h in whole px inside {size[0]}x{size[1]}, at least {LEAST_SIDE}x{LEAST_SIDE}"


def flattest(frames: Values, top: float, taken: Bools | None = None) -> Region:
    """A window with the least variance over its pixels and the frames (T, rows, columns): first of `windows`.
    InputError for values that are not finite."""
    if not np.isfinite(frames).all():
        raise InputError("frames: they hold values that are not finite; allowed: finite numbers")
    return next(windows(frames, top, taken))


def windows(frames: Values, top: float, taken: Bools | None = None) -> Iterator[Region]:
    """Windows of frames (T, rows, columns), at least one, those with the least variance over pixels and frames first.

    Of those that differ from the least by chance alone it is the middle one: the least of many would tell of a
    fixed pattern that is too weak.

    They are 64 px wide and high, or half of the picture's shorter side; then half as large. None overlaps
    another of its size. Rows and columns may have levels of their own (they are taken out over the whole
    picture first, by medians). Windows that touch count 0 or `top` in more than 2 % of their values, or
    hold a pixel of `taken` (rows, columns), are used only where there are no others.
    """
    rows, columns = frames.shape[1:]
    side = min(SIDE, max(min(rows, columns) // 2, min(rows, columns, LEAST_SIDE)))
    picked = frames[np.unique(np.linspace(0, len(frames) - 1, _LOOKED_AT).astype(int))].astype(np.float64)
    spoilt = ((picked <= 0) | (picked >= top)).mean(axis=0)
    held = np.zeros((rows, columns)) if taken is None else taken.astype(np.float64)
    level = np.median(picked, axis=0)
    picked -= _fine_lines(level, axis=1)[:, None] + _fine_lines(level, axis=0)
    picked -= picked.mean(axis=(1, 2), keepdims=True)  # the frame's own drift
    mean, square = picked.mean(axis=0), np.square(picked).mean(axis=0)
    found = False
    for wide in (side, side // 2) if side // 2 >= _LEAST_HALF else (side,):
        spread, error = _spread(mean, square, len(picked), wide)
        crossed, unfit = _windows(held, wide) > 0.5 / wide**2, _windows(spoilt, wide) > _SPOILT
        for region in _least(np.where(unfit, np.inf, spread), error, wide, crossed):
            found = True
            yield region
    if not found:
        spread, error = _spread(mean, square, len(picked), side)
        worse = (_windows(held, side) > 0.5 / side**2) + 2.0 * (_windows(spoilt, side) > _SPOILT)
        yield next(_least(spread + (spread.max() + 1) * worse, error, side, np.zeros(spread.shape, np.bool_)))


def _spread(mean: Floats, square: Floats, frames: int, side: int) -> tuple[Floats, Floats]:
    """Variance over the pixels and frames of windows, by their top left corner, and its standard error by chance.

    mean, square (rows, columns) over so many frames. What stays, and what changes from frame to frame, are taken for
    Gaussian and independent from pixel to pixel: sqrt(2 / n) of each variance.
    """
    level = _windows(mean, side) ** 2
    spread, still = _windows(square, side) - level, _windows(mean**2, side) - level
    return spread, np.sqrt(2) / side * np.hypot(still, (spread - still) / np.sqrt(frames))


def _least(costs: Floats, error: Floats, side: int, crossed: Bools) -> Iterator[Region]:
    """Windows with the least costs first, none over another, by costs of all top left corners; none of infinite, and
    none that targets have `crossed`.

    Of those whose cost is the least but for its standard error, the middle one, or the next to it that is not crossed:
    so that truth moves a region off its targets, and no other.
    """
    step = max(side // 8, 1)
    left, error, crossed = costs[::step, ::step].copy(), error[::step, ::step], crossed[::step, ::step]
    reach = -(-side // step)
    offered = 0
    while offered < _TRIES:
        least = int(np.argmin(left))
        if np.isinf(left.flat[least]):
            return
        order = np.argsort(left, axis=None, kind="stable")
        alike = int((left <= left.flat[least] + _ALIKE * error.flat[least]).sum())
        free = np.flatnonzero(~crossed.flat[order[:alike]])
        if not free.size:
            left.flat[order[:alike]] = np.inf
            continue
        middle = order[free[np.argmin(np.abs(free - (alike - 1) // 2))]]
        row, column = (int(place) for place in np.unravel_index(middle, left.shape))
        offered += 1
        yield Region(column * step, row * step, side, side)
        left[max(row - reach + 1, 0) : row + reach, max(column - reach + 1, 0) : column + reach] = np.inf


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


def _fine_lines(level: Floats, axis: int) -> Floats:
    """What each row (axis 1) or column (axis 0) lies above the mean of its neighbours, by its median."""
    other = 1 - axis
    around = (np.roll(level, 1, other) + np.roll(level, -1, other)) / 2
    lines: Floats = np.median(level - around, axis=axis) / 2
    lines[[0, -1]] = 0
    return lines


def _windows(values: Floats, side: int) -> Floats:
    """Means over all windows of side x side px, by their top left corner."""
    sums = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    total: Floats = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    return total / side**2
