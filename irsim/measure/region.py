"""The part of a picture where only noise is seen."""

from __future__ import annotations

import itertools
import math
import reprlib
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError, as_whole
from irsim.measure.given import check_above, check_frames, check_taken
from irsim.measure.over_time import median_of
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


def as_region(given: object, frames: Values) -> Region:
    """The region that a caller gave as four whole numbers; InputError where it is none within the frames."""
    rows, columns = frames.shape[1:]
    try:
        if not (isinstance(given, tuple | list) and len(given) == 4):
            raise TypeError
        region = Region(*map(as_whole, given))
    except TypeError:
        raise InputError(f"region {reprlib.repr(given)}: allowed: four whole numbers (x, y, w, h), px") from None
    check_region(region, str(tuple(region)), (columns, rows))
    return region


def _allowed(size: tuple[int, int]) -> str:
    return f"allowed: x,y,w,h in whole px inside {size[0]}x{size[1]}, at least {LEAST_SIDE}x{LEAST_SIDE}"


def flattest(frames: Values, top: float, taken: Bools | None = None) -> Region:
    """A window with the least variance over its pixels and the frames (T, rows, columns): first of `windows`.
    InputError for frames that are no such array of finite numbers, a `top` that is no number above 0, and `taken` that
    is no mask of their size."""
    check_frames(frames)
    check_above(top, "top", "the highest count that there can be", math.inf)
    check_taken(taken, frames.shape[1:])
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
    picked = [frames[k] for k in np.unique(np.linspace(0, len(frames) - 1, _LOOKED_AT).astype(int))]
    held = np.zeros((rows, columns)) if taken is None else taken.astype(np.float64)
    level = median_of(picked).astype(np.float64)
    lines = _fine_lines(level, axis=1)[:, None] + _fine_lines(level, axis=0)
    mean, square, spoilt = (np.zeros((rows, columns)) for _ in range(3))
    for frame in picked:
        spoilt += (frame <= 0) | (frame >= top)
        apart = frame - lines
        apart -= apart.mean()  # the frame's own drift
        mean += apart
        square += np.square(apart, out=apart)
    for total in (mean, square, spoilt):
        total /= len(picked)
    found = False
    for wide in (side, side // 2) if side // 2 >= _LEAST_HALF else (side,):
        step = _step(wide)
        spread, error = _spread(mean, square, len(picked), wide, step)
        crossed, unfit = _windows(held, wide, step) > 0.5 / wide**2, _windows(spoilt, wide, step) > _SPOILT
        for region in _least(np.where(unfit, np.inf, spread), error, wide, crossed):
            found = True
            yield region
    if not found:
        step = _step(side)
        spread, error = _spread(mean, square, len(picked), side, step)
        worse = (_windows(held, side, step) > 0.5 / side**2) + 2.0 * (_windows(spoilt, side, step) > _SPOILT)
        yield next(_least(spread + (spread.max() + 1) * worse, error, side, np.zeros(spread.shape, np.bool_)))


def _step(side: int) -> int:
    """By how many px the windows of a side that are looked at lie apart."""
    return max(side // 8, 1)


def _spread(mean: Floats, square: Floats, frames: int, side: int, step: int) -> tuple[Floats, Floats]:
    """Variance over the pixels and frames of windows, as `_windows` has them, and its standard error by chance.

    mean, square (rows, columns) over so many frames. What stays, and what changes from frame to frame, are taken for
    Gaussian and independent from pixel to pixel: sqrt(2 / n) of each variance.
    """
    level = _windows(mean, side, step) ** 2
    spread, still = _windows(square, side, step) - level, _windows(mean**2, side, step) - level
    return spread, np.sqrt(2) / side * np.hypot(still, (spread - still) / np.sqrt(frames))


def _least(costs: Floats, error: Floats, side: int, crossed: Bools) -> Iterator[Region]:
    """Windows with the least costs first, none over another, by costs of their top left corners, a `_step` apart; none
    of infinite, and none that targets have `crossed`.

    Of those whose cost is the least but for its standard error, the middle one, or the next to it that is not crossed:
    so that truth moves a region off its targets, and no other.
    """
    step, left = _step(side), costs.copy()
    reach = -(-side // step)
    offered = 0
    while offered < _TRIES:
        least = int(np.argmin(left))
        if np.isinf(left.flat[least]):
            return
        alike = np.flatnonzero(left <= left.flat[least] + _ALIKE * error.flat[least])
        alike = alike[np.argsort(left.flat[alike], kind="stable")]
        free = np.flatnonzero(~crossed.flat[alike])
        if not free.size:
            left.flat[alike] = np.inf
            continue
        middle = alike[free[np.argmin(np.abs(free - (len(alike) - 1) // 2))]]
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


def _windows(values: Floats, side: int, step: int) -> Floats:
    """Means over windows of side x side px, by their top left corner, of which each `step`-th row and column counts."""
    sums = np.pad(values, ((1, 0), (1, 0)))
    for axis in (0, 1):
        np.cumsum(sums, axis=axis, out=sums)
    first, last = slice(None, -side, step), slice(side, None, step)
    total: Floats = sums[last, last] - sums[first, last] - sums[last, first] + sums[first, first]
    return total / side**2
