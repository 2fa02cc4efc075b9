"""Level: noise of the mean of whole frames, white or correlated over time.

Sigmas and time constants on a grid are weighted by the restricted likelihood of an AR(1) series (D. A. Harville,
Biometrika 61, 1974), computed by a Kalman filter, with a prior that is uniform in both logarithms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irsim.calibration.statistics import LEVEL, Estimate, root
from irsim.calibration.temporal import LEAST_MEMORY_FRAMES, LINE_CORRELATION, Memory
from irsim.types import Floats, Indices


@dataclass(frozen=True)
class Level:
    """Sigma of the means of whole frames, and time constant of their correlation, frames; None where they are white."""

    sigma: Estimate
    time_frames: Estimate | None


def fit_level(levels: Floats, known: float, number: Indices) -> Level:
    """Return the level of a series (T,) that also contains white noise of variance `known`.

    Values are posterior medians, and ends are quantiles. The level counts as correlated where correlated noise is 20
    times likelier than white noise. A series hardly constrains time constants longer than itself. Upper ends therefore
    include constants of up to thirty times its duration, where these are as likely.
    """
    count = len(levels)
    sigmas = np.geomspace(1 / 100, 20, 50) * (float(np.std(levels, ddof=1)) + 1e-9)
    length = int(number[-1] - number[0]) + 1
    times = np.geomspace(1.0, 30.0 * length, 44)
    inside = times <= length
    decays = np.exp(-np.diff(number)[:, None] / times)
    white = _series_likelihood(levels, np.zeros((count - 1, 1)), sigmas, known)[0]
    table = _series_likelihood(levels, decays, sigmas, known)
    top = max(white.max(), table.max())
    none, lasting = white[0] > top - 1.96**2 / 2, table[~inside].max() > top - 1.96**2 / 2
    white, table = np.exp(white - top), np.exp(table - top)
    if table[inside].sum() / inside.sum() <= 20 * white.sum():
        sigma = _quantiles(sigmas, white)
        return Level(replace(sigma, low=0.0) if none else sigma, None)
    sigma, time = _quantiles(sigmas, table[inside].sum(axis=0)), _quantiles(times[inside], table[inside].sum(axis=1))
    if lasting:
        sigma = replace(sigma, high=max(sigma.high, _quantiles(sigmas, table.sum(axis=0)).high))
        time = replace(time, high=max(time.high, _quantiles(times, table.sum(axis=1)).high))
    return Level(sigma, time)


def without_means(level: Level, memories: list[tuple[Memory | None, int]], seconds: float) -> Level:
    """Return the level without the variance that correlated pixels and lines leave in the mean of a frame.

    memories    noise over time of pixels, rows and columns, each with their number in a frame
    seconds     duration T of the recording: a random walk of unit variance per second has the variance T / 6 about its
                mean
    """
    theirs = sum(
        (memory.total.value**2 + memory.walk.value**2 * seconds / 6) / count
        for memory, count in memories
        if memory is not None
    )
    if level.time_frames is None:
        return replace(level, sigma=replace(level.sigma, low=root(level.sigma.low**2 - theirs)))
    if level.sigma.value**2 > 4 * theirs:
        return level
    return Level(Estimate(0.0, 0.0, level.sigma.high), None)


def is_correlated(levels: Floats, number: Indices, sigma: Estimate) -> bool:
    """Return True for frame means (T,) of significant `sigma` that are correlated from frame to frame."""
    after = np.flatnonzero(np.diff(number) == 1)
    if len(after) < LEAST_MEMORY_FRAMES or sigma.low <= 0:
        return False
    apart = levels - levels.mean()
    return float(np.mean(apart[after] * apart[after + 1])) > LINE_CORRELATION * sigma.value**2


def _series_likelihood(levels: Floats, decays: Floats, sigmas: Floats, known: float) -> Floats:
    """Return the restricted log likelihood (times, sigmas) of a series (T,).

    decays  (T - 1, times) correlation of the level with that of the frame before
    known   variance of additional white noise
    """
    level, noise = np.square(sigmas), known + 1e-12
    series = np.stack([levels - levels.mean(), np.ones(len(levels))], axis=1)
    predicted, variance = np.zeros((2, decays.shape[1], len(sigmas))), level
    sums = np.zeros((4, decays.shape[1], len(sigmas)))
    for frame, seen in enumerate(series):
        if frame:
            kept = decays[frame - 1][:, None]
            predicted, variance = kept * predicted, kept**2 * variance + (1 - kept**2) * level
        total = variance + noise
        new, unit = innovation = seen[:, None, None] - predicted
        sums += [np.broadcast_to(np.log(total), new.shape), new**2 / total, new * unit / total, unit**2 / total]
        predicted, variance = predicted + variance / total * innovation, variance * noise / total
    entropy, squares, crossed, ones = sums
    return np.asarray(-0.5 * (entropy + np.log(ones / len(levels)) + squares - crossed**2 / ones))


def _quantiles(values: Floats, weights: Floats) -> Estimate:
    """Return the weighted median and interval of values that are evenly spaced in their logarithm."""
    shares = np.cumsum(weights) / weights.sum() - weights / weights.sum() / 2
    ends = np.interp([0.5, (1 - LEVEL) / 2, (1 + LEVEL) / 2], shares, np.log(values))
    return Estimate(*(float(np.exp(end)) for end in ends))
