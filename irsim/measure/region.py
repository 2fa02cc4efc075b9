"""The part of a picture where only noise is seen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError
from irsim.types import Floats

Values = npt.NDArray[np.floating] | npt.NDArray[np.integer] | npt.NDArray[np.integer | np.floating]
"""Counts as they come, or in any unit."""

SIDE = 64
LEAST_SIDE = 4
_LOOKED_AT = 24
_SPOILT = 0.02


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
    columns, rows = size
    allowed = f"allowed: x,y,w,h in whole px inside {columns}x{rows}, at least {LEAST_SIDE}x{LEAST_SIDE}"
    words = text.split(",")
    if len(words) != 4 or not all(word.strip().isdecimal() for word in words):
        raise InputError(f"--region {text}: is no region; {allowed}")
    region = Region(*(int(word) for word in words))
    inside = region.x + region.w <= columns and region.y + region.h <= rows
    if not inside or min(region.w, region.h) < LEAST_SIDE:
        raise InputError(f"--region {text}: does not fit; {allowed}")
    return region


def flattest(frames: Values, top: float) -> Region:
    """The window with the least variance over its pixels and the frames (T, rows, columns).

    It is 64 px wide and high, or half of the picture's shorter side. Rows and columns may have levels
    of their own (they are taken out over the whole picture first, by medians); windows that touch
    count 0 or `top` in more than 2 % of their values are used only where there is no other.
    """
    rows, columns = frames.shape[1:]
    side = min(SIDE, max(min(rows, columns) // 2, min(rows, columns, LEAST_SIDE)))
    picked = frames[np.unique(np.linspace(0, len(frames) - 1, _LOOKED_AT).astype(int))].astype(np.float64)
    spoilt = ((picked <= 0) | (picked >= top)).mean(axis=0)
    level = np.median(picked, axis=0)
    picked -= _fine_lines(level, axis=1)[:, None] + _fine_lines(level, axis=0)
    picked -= picked.mean(axis=(1, 2), keepdims=True)  # the frame's own drift
    mean = _windows(picked.mean(axis=0), side)
    spread = _windows(np.square(picked).mean(axis=0), side) - mean**2
    step = max(side // 8, 1)
    bad = _windows(spoilt, side) > _SPOILT
    cost = np.where(bad, spread + spread.max() + 1, spread)[::step, ::step]
    row, column = np.unravel_index(int(np.argmin(cost)), cost.shape)
    return Region(int(column) * step, int(row) * step, side, side)


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
