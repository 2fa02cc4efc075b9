"""How the level of whole frames wanders: a first-order autoregressive process, read off one series."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irsim.measure.interval import ENDS, LEVEL, Measured
from irsim.types import Floats, Indices

_TIMES = 52
"""Of which 30 are up to the length of a series of 100."""
_SIGMAS = 60
_SLOWER = 30.0
"""Times the series' length: up to that are time constants of which upper ends are told. They grow with it, for of a
level so slow the series tells only by how much it goes in a frame. Up to ten times they held in 38 to 40 of 40."""
_ODDS = 20.0
"""Odds from which a level is said to have memory."""


@dataclass(frozen=True)
class Level:
    """sigma: of the level, in its units; time_frames: in which its correlation falls to 1/e, None where it is white."""

    sigma: Measured
    time_frames: Measured | None


def fit_level(levels: Floats, known: float, number: Indices | None = None) -> Level:
    """Of a series (T,) that holds white noise of variance `known` besides, of frames taken at `number` (T,) if not all.

    Every sigma and time constant on a grid is weighed by the likelihood of the series less its mean
    (D. A. Harville, "Bayesian inference for variance components using only error contrasts", Biometrika
    61, 1974), all of either even in log before. Values are medians, ends the quantiles. Slower than the
    series is long cannot be told: time constants up to its length give values and lower ends. Upper ends also count
    those up to thirty times as long, if one of them is as likely as an interval's ends are. The lower end is 0 where no
    level at all is as likely as these.
    """
    count = len(levels)
    spread = float(np.std(levels, ddof=1)) + 1e-9
    sigmas = np.geomspace(spread / 100, spread * 20, _SIGMAS)
    number = np.arange(count) if number is None else number
    length = int(number[-1] - number[0]) + 1
    times = np.geomspace(1.0, _SLOWER * length, _TIMES)
    told = times <= length
    kept = np.exp(-np.diff(number)[:, None] / times)
    white = _likelihood(levels, np.zeros((count - 1, 1)), sigmas, known)[0]
    table = _likelihood(levels, kept, sigmas, known)
    top = max(white.max(), table.max())
    likely = top - ENDS**2 / 2
    none, lasting = white[0] > likely, table[~told].max() > likely
    white, table = np.exp(white - top), np.exp(table - top)
    if table[told].sum() / told.sum() <= _ODDS * white.sum():
        sigma = _quantiles(sigmas, white)
        return Level(replace(sigma, low=0.0) if none else sigma, None)
    sigma, time = _weighed(sigmas, times[told], table[told])
    if lasting:
        slow_sigma, slow_time = _weighed(sigmas, times, table)
        sigma = replace(sigma, high=max(sigma.high, slow_sigma.high))
        time = replace(time, high=max(time.high, slow_time.high))
    return Level(sigma, time)


def _likelihood(levels: Floats, kept: Floats, sigmas: Floats, known: float) -> Floats:
    """(times, sigmas) log likelihood of what is left of a series without its mean; kept (T - 1, times): what each frame
    has left of the level of the one before.

    With V the covariance of the series y and 1 a series of ones, it is that of y by log |V|, y V^-1 y, y V^-1 1 and
    1 V^-1 1, summed up by a Kalman filter a frame at a time: threads that take a matrix apart wait on each other for
    seconds where several processes share the cores.
    """
    level, noise = np.square(sigmas), known + 1e-12
    series = np.stack([levels - levels.mean(), np.ones(len(levels))], axis=1)
    foretold, variance = np.zeros((2, kept.shape[1], len(sigmas))), level
    sums = np.zeros((4, kept.shape[1], len(sigmas)))
    for frame, seen in enumerate(series):
        if frame:
            left = kept[frame - 1][:, None]
            foretold, variance = left * foretold, left**2 * variance + (1 - left**2) * level
        total = variance + noise
        new, unit = off = seen[:, None, None] - foretold
        sums += [np.broadcast_to(np.log(total), new.shape), new**2 / total, new * unit / total, unit**2 / total]
        foretold, variance = foretold + variance / total * off, variance * noise / total
    entropy, squares, crossed, ones = sums
    return np.asarray(-0.5 * (entropy + np.log(ones / len(levels)) + squares - crossed**2 / ones))


def _weighed(sigmas: Floats, times: Floats, table: Floats) -> tuple[Measured, Measured]:
    """Sigma and time constant by likelihoods (times, sigmas)."""
    return _quantiles(sigmas, table.sum(axis=0)), _quantiles(times, table.sum(axis=1))


def _quantiles(values: Floats, weights: Floats) -> Measured:
    """Median and interval of values that stand evenly in log, by their weights."""
    shares = np.cumsum(weights) / weights.sum() - weights / weights.sum() / 2
    ends = np.interp([0.5, (1 - LEVEL) / 2, (1 + LEVEL) / 2], shares, np.log(values))
    return Measured(*(float(np.exp(end)) for end in ends))
