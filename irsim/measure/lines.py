"""Rows and columns with offsets of their own, told from the texture of a scene by where they lie in its spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.measure.interval import LEVEL, Measured, jackknife, root
from irsim.types import Floats

_FINEST = 0.1
"""Cycles a px from which lines are looked for: below, a scene's horizon and slopes speak."""
_HANN_GAIN = 2 / 3
"""(sum w)^2 / (N sum w^2) of a Hann window."""
_OVERLAP = 35 / 128 / (3 / 8) ** 2
"""By how much a Hann window lowers the number of independent frequencies: N sum w^4 / (sum w^2)^2."""
_BLOCKS = 8


@dataclass(frozen=True)
class Lines:
    """Sigmas of offsets from row to row and from column to column, in the units of the picture."""

    row: Measured
    column: Measured


def lines(periodogram: Floats, density: Floats, shape: tuple[int, int]) -> Lines:
    """Lines of a picture (rows, columns) by its periodogram beside the `density` of all else.

    Offsets of rows are all in the frequencies with fx = 0, where they have columns x 2/3 times their
    variance under a Hann window. Intervals: mean powers over chi-squares.
    """
    rows, columns = shape
    down, across = np.fft.fftfreq(rows), np.fft.rfftfreq(columns)
    y, x = (down > _FINEST) & (down < 0.49), (across > _FINEST) & (across < 0.49)
    return Lines(
        _excess(periodogram[y, 0], density[y, 0], columns * _HANN_GAIN),
        _excess(periodogram[0, x], density[0, x], rows * _HANN_GAIN),
    )


def _excess(power: Floats, expected: Floats, gain: float) -> Measured:
    """Sigma of lines from powers at n frequencies beside those expected without them."""
    from scipy.stats import chi2

    freedom = 2 * power.size / _OVERLAP
    mean, usual = float(power.mean()), float(expected.mean())
    low, high = (mean * freedom / chi2.ppf(end, freedom) for end in ((1 + LEVEL) / 2, (1 - LEVEL) / 2))
    return Measured(*(root((x - usual) / gain) for x in (mean, float(low), float(high))))


def turns(picture: Floats, axis: int) -> Measured:
    """By how much even rows (axis 0) or columns (1) of a picture lie above odd ones, halved; below 0 where below.

    Each is compared with the mean of its two neighbours; the interval is that of a jackknife over 8 blocks.
    """
    level = picture.mean(axis=1 - axis)
    above = (level[1:-1] - (level[:-2] + level[2:]) / 2) / 2 * np.where(np.arange(1, len(level) - 1) % 2, -1, 1)
    pairs = above[: len(above) // 2 * 2].reshape(-1, 2).mean(axis=1)
    blocks = np.array([block.mean() for block in np.array_split(pairs, min(_BLOCKS, len(pairs)))])
    return jackknife(blocks[:, None], lambda mean: mean)[0]


def without_turns(picture: Floats, rows: float, columns: float) -> Floats:
    """The picture less what even and odd rows and columns differ by (halves, as `turns` gives them)."""
    signs = [np.where(np.arange(length) % 2, -1.0, 1.0) for length in picture.shape]
    evened: Floats = picture - rows * signs[0][:, None] - columns * signs[1]
    return evened
