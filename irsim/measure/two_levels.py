"""What goes to and fro between two levels: when it is on the upper one, and where both are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from irsim.types import Bools, Floats


class TwoLevels(NamedTuple):
    """high (T, pixels): above the middle of the highest and the lowest; upper, lower (pixels,): means of both parts;
    within (pixels,): share of the variance that is left within them, 0.36 (1 - 2/pi) of Gaussian noise without levels;
    1 of what does not change."""

    high: Bools
    upper: Floats
    lower: Floats
    within: Floats


def two_levels(series: Floats) -> TwoLevels:
    """Of series (T, pixels), float64."""
    high = series > (series.max(axis=0) + series.min(axis=0)) / 2
    upper, lower = (np.where(part, series, 0).sum(axis=0) / part.sum(axis=0).clip(1) for part in (high, ~high))
    left, variance = (series - np.where(high, upper, lower)).var(axis=0), series.var(axis=0)
    return TwoLevels(high, upper, lower, np.where(variance > 0, left / np.where(variance > 0, variance, 1), 1.0))
