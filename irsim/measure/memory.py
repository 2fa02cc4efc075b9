"""What noise remembers from frame to frame: white noise plus a first-order autoregressive one.

Read off the differences of frames k apart, which fixed pattern leaves alone: half their variance is
w^2 + s^2 (1 - rho^k) for white noise of sigma w and AR(1) noise of sigma s and lag-1 correlation rho.

What drifts for much longer than the recording lasts, as non-uniformity does between corrections, adds d k. In so many
frames nobody can tell it from a part of slow AR(1) noise, so intervals hold what both readings allow, with and without.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from irsim.measure.interval import Measured, jackknife, root
from irsim.measure.region import Values
from irsim.measure.repeats import Indices
from irsim.types import Floats

LAGS = (1, 2, 3, 5, 9, 18, 36, 72)
LEAST_FRAMES = 12
_BLOCKS = 6
_FLOOR = 1e-12
_LEAST_PAIRS = 0.25
"""Share of the frames that must have another one so far on for a lag to be told, but for the first."""
_LONGEST = 20.0
"""Time constants are looked for up to so many times the longest lag: whatever is longer looks alike in it."""
_NEAR = 1e-6
"""The end of a search is met within this."""
_LEAST_CORRELATION = 0.02
"""Correlation below which noise is called white: cooled cameras show up to 0.01 of either sign."""


@dataclass(frozen=True)
class Memory:
    """Noise with memory, in the units of the frames.

    white, correlated       sigmas of the part without and the part with memory
    total                   sigma of both
    rho, time_constant_s    of the correlated part; its correlation over k frames is rho^k. Where they may be longer
                            than can be told, up to 1 and infinity
    pixel                   sigma of the fixed pattern from pixel to pixel, freed of the time mean of both
    """

    white: Measured
    correlated: Measured
    total: Measured
    rho: Measured
    time_constant_s: Measured
    pixel: Measured


@dataclass(frozen=True)
class Temporal:
    """How noise goes on in time.

    pair            sigma from differences of neighbouring frames, over sqrt(2)
    lags            differences' lags, frames of the camera
    difference      sigma from differences of frames that many apart, over sqrt(2)
    correlation     of noise over each lag (1 - difference^2 / total^2)
    memory          None where noise is white in time, or the frames too few to tell
    """

    pair: Measured
    lags: tuple[int, ...]
    difference: tuple[float, ...]
    correlation: tuple[Measured, ...]
    memory: Memory | None


def temporal(frames: Values, rate_hz: float, number: Indices | None = None) -> Temporal:
    """Lag correlations and memory of the pixels' noise in frames (T, rows, columns) of a flat scene.

    number  (T,) rising: when the frames were taken, in frames of the camera at `rate_hz`; each after the other where
            not given. Two neighbours at least must follow each other.

    Rows, columns and frames as a whole may have noise of their own: it is taken out first. Intervals
    are those of a jackknife over 36 blocks of pixels.
    """
    values = centred(np.asarray(frames, np.float64))
    times, rows, columns = values.shape
    scale = rows * columns / ((rows - 1) * (columns - 1))  # what centring took from the variance
    number = np.arange(times) if number is None else number
    lags = tuple(_lags(number))
    pictures = [_squares(values, number, lag) / 2 * scale for lag in lags]
    pictures += [values.var(axis=0) * scale, np.square(values.mean(axis=0)) * scale]
    blocks = _blocks(np.stack(pictures, axis=-1))
    mean_correlation = _mean_correlation(number)

    def statistic(means: Floats, drifts: bool = False) -> Floats:
        white, correlated, decay = fit_memory(lags, means[: len(lags)], drifts)
        total = white + correlated
        mean_part = (white + correlated * mean_correlation(decay)) / times
        return np.array(
            [
                means[0],
                white,
                correlated,
                total,
                math.log(decay),
                means[-1] - mean_part,
                *(1 - means[: len(lags)] / max(total, _FLOOR)),
            ]
        )

    # What the frames show without a model: correlations about the variance within the recording.
    def plain(means: Floats) -> Floats:
        within = max(means[-2] * times / (times - 1), _FLOOR)
        return np.array([means[0], *(1 - means[: len(lags)] / within), means[len(lags) - 1] - means[0]])

    pair, *shown, rise = jackknife(blocks, plain)
    memory = None
    correlation = tuple(shown)
    remembered = rise.low > 0 and shown[0].low > _LEAST_CORRELATION
    if times >= LEAST_FRAMES and remembered:
        steady, drifting = (jackknife(blocks, partial(statistic, drifts=drifts)) for drifts in (False, True))
        _, white, correlated, total, log_decay, pixel, *modelled = map(_either, steady, drifting)
        correlation = tuple(modelled)
        if log_decay.low <= _least_decay(lags) + _NEAR:
            # It may last for any longer: of what stays over the recording nobody can tell it from fixed pattern.
            within, staying = (float(blocks[:, len(lags) + i].mean()) for i in range(2))
            log_decay = replace(log_decay, low=-math.inf)
            correlated, total = (
                replace(each, low=min(each.low, within), high=each.high + staying) for each in (correlated, total)
            )
            pixel = replace(pixel, low=0.0, high=max(pixel.high, staying))
        memory = Memory(
            white=white.map(root),
            correlated=correlated.map(root),
            total=total.map(root),
            rho=log_decay.map(lambda x: math.exp(-math.exp(x))),
            time_constant_s=log_decay.map(lambda x: math.exp(-x) / rate_hz),
            pixel=pixel.map(root),
        )
    differences = tuple(root(float(blocks[:, i].mean())) for i in range(len(lags)))
    return Temporal(pair.map(root), lags, differences, correlation, memory)


def _either(one: Measured, other: Measured) -> Measured:
    """The first, with an interval that holds both."""
    return Measured(one.value, min(one.low, other.low), max(one.high, other.high))


def time_freedom(memory: Memory | None, number: Indices) -> float:
    """Degrees of freedom of a series about its mean, of frames taken at `number` (T,), in frames of the camera.

    (tr R)^2 / tr R^2 of the centred correlation matrix R: F. E. Satterthwaite, "An approximate
    distribution of estimates of variance components", Biometrics Bulletin 2 (1946).
    """
    if memory is None or not memory.total.value:
        return len(number) - 1
    share = (memory.correlated.value / memory.total.value) ** 2
    apart = np.abs(np.subtract.outer(number, number))
    matrix = share * memory.rho.value**apart + (1 - share) * np.eye(len(number))
    matrix = matrix - matrix.mean(axis=0) - matrix.mean(axis=1)[:, None] + matrix.mean()
    return float(np.trace(matrix) ** 2 / np.square(matrix).sum())


def mean_share(memory: Memory | None, number: Indices) -> float:
    """Variance of the mean over that of the noise, of frames taken at `number` (T,), in frames of the camera."""
    if memory is None or not memory.total.value:
        return 1 / len(number)
    share = (memory.correlated.value / memory.total.value) ** 2
    return (1 - share + share * _mean_correlation(number)(-math.log(memory.rho.value))) / len(number)


def centred(values: Floats) -> Floats:
    """Each frame less its row and column means; (T, rows, columns)."""
    level = values.mean(axis=(1, 2), keepdims=True)
    centred: Floats = values - values.mean(axis=1, keepdims=True) - values.mean(axis=2, keepdims=True) + level
    return centred


def _least_decay(lags: tuple[int, ...]) -> float:
    """The logarithm of the slowest decay a frame that is looked for."""
    return math.log(1 / (_LONGEST * lags[-1]))


def fit_memory(lags: tuple[int, ...], half_squares: Floats, drifts: bool = False) -> tuple[float, float, float]:
    """(w^2, s^2, -log rho), least squares of w^2 + s^2 (1 - rho^k) in the logarithm's first order; d k is added where
    it `drifts`.

    half_squares    (lags,) half the mean squared difference of frames that far apart
    """
    wanted = np.asarray(half_squares, np.float64)
    lag = np.asarray(lags, np.float64)
    low, high = _least_decay(lags), math.log(6.0)
    for _ in range(4):
        decays = np.linspace(low, high, 61)
        shapes = (1 - np.exp(-lag * math.exp(decay)) for decay in decays)
        found = [_drifting(shape, lag, wanted) if drifts else _linear(shape, wanted) for shape in shapes]
        best = int(np.argmin([error for _, _, error in found]))
        low, high = decays[max(best - 1, 0)], decays[min(best + 1, 60)]
    white, correlated, _ = found[best]
    return white, correlated, math.exp(decays[best])


def _linear(shape: Floats, wanted: Floats) -> tuple[float, float, float]:
    """w^2 >= 0 and s^2 >= 0 of w^2 + s^2 shape ~ wanted with equal relative errors, and the sum of squares."""
    a, b = 1 / wanted.clip(_FLOOR), shape / wanted.clip(_FLOOR)
    aa, ab, bb, ay, by = a @ a, a @ b, b @ b, a.sum(), b.sum()
    determinant = max(aa * bb - ab * ab, _FLOOR * aa * bb)
    white, correlated = (bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant
    if white < 0:
        white, correlated = 0.0, by / bb
    elif correlated < 0:
        white, correlated = ay / aa, 0.0
    return float(white), float(correlated), float(np.square(white * a + correlated * b - 1).sum())


def _drifting(shape: Floats, lag: Floats, wanted: Floats) -> tuple[float, float, float]:
    """The same with d >= 0 of d lag besides."""
    from scipy.optimize import nnls

    parts = np.stack([np.ones_like(shape), shape, lag], axis=1) / wanted.clip(_FLOOR)[:, None]
    (white, correlated, _), left = nnls(parts, np.ones_like(shape))
    return float(white), float(correlated), float(left) ** 2


def _lags(number: Indices) -> Iterator[int]:
    """Those of `LAGS`, up to half of the frames, over which enough frames taken at `number` have another one."""
    times = len(number)
    for lag in LAGS:
        pairs = int(np.isin(number + lag, number, assume_unique=True).sum())
        if lag == 1 or (lag <= times // 2 and pairs >= _LEAST_PAIRS * times):
            yield lag


def _squares(values: Floats, number: Indices, lag: int) -> Floats:
    """(rows, columns) mean squared differences of all frames that were taken `lag` apart."""
    later = np.searchsorted(number, number + lag).clip(max=len(number) - 1)
    pairs = np.flatnonzero(number[later] == number + lag)
    total = np.zeros(values.shape[1:])
    for first, second in zip(pairs, later[pairs], strict=True):
        total += np.square(values[second] - values[first])
    return total / len(pairs)


def _mean_correlation(number: Indices) -> Callable[[float], float]:
    """T times the variance of the mean of T frames of unit AR(1) noise, by its decay a frame of the camera."""
    apart = np.abs(np.subtract.outer(number, number)).ravel()
    pairs = np.bincount(apart) / len(number)
    lag = np.arange(len(pairs))
    return lambda decay: float(pairs @ np.exp(-decay * lag))


def _blocks(pictures: Floats) -> Floats:
    """Means over a grid of up to 6 x 6 equal blocks of (rows, columns, ...); what is over at the ends is left."""
    rows, columns = pictures.shape[:2]
    down, across = min(_BLOCKS, rows // 2), min(_BLOCKS, columns // 2)
    high, wide = rows // down, columns // across
    cut = pictures[: down * high, : across * wide].reshape(down, high, across, wide, -1)
    means: Floats = cut.mean(axis=(1, 3)).reshape(down * across, -1)
    return means
