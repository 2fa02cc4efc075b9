"""The flattest windows of a picture: where only noise is seen."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.measure.ends import at_an_end, ends_of
from irsim.measure.given import Values, check_above, check_frames, check_taken
from irsim.measure.over_time import median_of
from irsim.measure.picked import evenly
from irsim.measure.region import LEAST_REGION_SIDE, Region
from irsim.types import Bools, Floats

WINDOW_SIDE = 64
"""Of the windows, px, where the picture is large enough."""
_LOOKED_AT = 24
_SPOILT = 0.02
_LEAST_HALF = 16
"""Windows are not halved below this many px a side: in fewer pixels slow motion does not show beside chance."""
_TRIES = 8
"""Windows of each size that are offered."""
_ALIKE = 4.0
"""Standard errors within which windows' variances say nothing of which is the flatter one."""


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
    picture first, by medians). Windows that touch an end of what counts can be in more than 2 % of their values, or
    hold a pixel of `taken` (rows, columns), are used only where there are no others.
    """
    rows, columns = frames.shape[1:]
    side = min(WINDOW_SIDE, max(min(rows, columns) // 2, min(rows, columns, LEAST_REGION_SIDE)))
    picked = [frames[k] for k in evenly(len(frames), _LOOKED_AT)]
    held = np.zeros((rows, columns)) if taken is None else taken.astype(np.float64)
    level = median_of(picked).astype(np.float64)
    lines = _fine_lines(level, axis=1)[:, None] + _fine_lines(level, axis=0)
    mean, square, spoilt = (np.zeros((rows, columns)) for _ in range(3))
    ends = ends_of(frames, top)
    for frame in picked:
        spoilt += at_an_end(frame, ends)
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
