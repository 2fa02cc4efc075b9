"""How the level of whole frames wanders: a first-order autoregressive process, read off one series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.measure.interval import LEVEL, Measured
from irsim.measure.repeats import Indices
from irsim.types import Floats

_TIMES = 30
_SIGMAS = 60
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
    series is long cannot be told: time constants reach up to its length.
    """
    count = len(levels)
    spread = float(np.std(levels, ddof=1)) + 1e-9
    sigmas = np.geomspace(spread / 100, spread * 20, _SIGMAS)
    number = np.arange(count) if number is None else number
    times = np.geomspace(1.0, count, _TIMES)
    apart = np.abs(np.subtract.outer(number, number))
    white = _likelihood(levels, np.eye(count), sigmas, known)
    table = np.stack([_likelihood(levels, np.exp(-apart / time), sigmas, known) for time in times])
    top = max(white.max(), table.max())
    white, table = np.exp(white - top), np.exp(table - top)
    if table.sum() / _TIMES <= _ODDS * white.sum():
        return Level(_quantiles(sigmas, white), None)
    return Level(_quantiles(sigmas, table.sum(axis=0)), _quantiles(times, table.sum(axis=1)))


def _likelihood(levels: Floats, correlation: Floats, sigmas: Floats, known: float) -> Floats:
    """(sigmas,) log likelihood of what is left of a series without its mean."""
    count = len(levels)
    contrasts = np.linalg.qr(np.concatenate([np.ones((count, 1)), np.eye(count)[:, 1:]], axis=1))[0][:, 1:]
    shares, vectors = np.linalg.eigh(contrasts.T @ correlation @ contrasts)
    squares = np.square(vectors.T @ (contrasts.T @ levels))
    variances = np.square(sigmas)[:, None] * shares.clip(0) + known + 1e-12
    return np.asarray(-0.5 * (np.log(variances) + squares / variances).sum(axis=1))


def _quantiles(values: Floats, weights: Floats) -> Measured:
    """Median and interval of values that stand evenly in log, by their weights."""
    shares = np.cumsum(weights) / weights.sum() - weights / weights.sum() / 2
    ends = np.interp([0.5, (1 - LEVEL) / 2, (1 + LEVEL) / 2], shares, np.log(values))
    return Measured(*(float(np.exp(end)) for end in ends))
