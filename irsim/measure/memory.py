"""What noise remembers from frame to frame: white noise plus a first-order autoregressive one, beside a slow drift.

What drifts for much longer than the recording lasts, as non-uniformity does between corrections, is in so many frames a
random walk (`irsim.measure.mixture`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from irsim.measure.cosines import Cosines
from irsim.measure.given import Values, as_number, check_above, check_frames
from irsim.measure.interval import Measured, jackknife, root, without
from irsim.measure.mixture import Mixture, fit_mixture, parts_at
from irsim.measure.noise_3d import check_size
from irsim.types import Floats, Indices

LAGS = (1, 2, 3, 5, 9, 18, 36, 72)
LEAST_MEMORY_FRAMES = 12
_BLOCKS = 6
_FLOOR = 1e-300
"""Stands for no variance, that nothing be divided by none."""
_OF_LENGTH = 0.25
"""Of what was seen, the time over which a walk is told from noise that forgets: long beside white noise, and short
beside the times that noise takes which looks like a walk."""
_LEAST_PAIRS = 0.25
"""Share of the frames that must have another one so far on for a lag to be told, but for the first."""
LEAST_CORRELATION = 0.02
"""Correlation below which noise is taken as white: cooled cameras show up to 0.01 of either sign."""


@dataclass(frozen=True)
class Memory:
    """Noise with memory, of pixels, rows or columns, in the units of the frames.

    white, correlated       sigmas of the part without and the part with memory
    total                   sigma of both
    rho, time_constant_s    of the correlated part; its correlation over k frames is rho^k. Where they may be longer
                            than can be told, up to 1 and infinity; sigmas have ends for up to ten times what was seen
    age_s                   time from a correction that took the correlated part away to the first frame, as is
                            likeliest; infinity where none did
    walk                    sigma by which what drifts has changed after a second; it grows as the root of time. 0 where
                            the noise goes without. Where it is all there is beside white noise, it is that of a walk,
                            or of AR(1) noise as slow: nobody can tell them apart
    left                    sigma that all these leave in the mean of the frames; of what drifts, as it has changed
                            since the first frame
    fixed                   sigma of the fixed pattern in the first frame: of the mean, freed of what is left in it
    """

    white: Measured
    correlated: Measured
    total: Measured
    rho: Measured
    time_constant_s: Measured
    age_s: float
    walk: Measured
    left: Measured
    fixed: Measured

    @property
    def told_walk(self) -> Measured | None:
        """What it walks, where that is told from nothing."""
        return self.walk if self.walk.low > 0 else None


@dataclass(frozen=True)
class Temporal:
    """How noise goes on in time.

    pair            sigma from differences of neighbouring frames, over sqrt(2)
    lags            differences' lags, frames of the camera
    difference      sigma from differences of frames that many apart, over sqrt(2)
    correlation     of noise over each lag, but for what drifts
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

    Rows, columns and frames as a whole may have noise of their own: it is taken out first. Intervals come of how
    36 blocks of pixels differ. InputError for frames that are no array of finite numbers, for fewer than 4 frames, rows
    or columns, for a rate that is no number above 0, and for numbers that do not rise.
    """
    check_frames(frames)
    check_size(frames)
    check_above(rate_hz, "rate_hz", "frames a second")
    values = centred(np.asarray(frames, np.float64))
    times, rows, columns = values.shape
    taken_at = as_number(number, times)
    lags = tuple(_lags(taken_at))
    pictures = [_squares(values, taken_at, lag) / 2 for lag in lags]
    pictures += [values.var(axis=0), np.square(values.mean(axis=0))]
    blocks = _blocks(np.stack(pictures, axis=-1))

    # What the frames show without a model: correlations about the variance within the recording.
    def plain(means: Floats) -> Floats:
        within = means[-2] * times / (times - 1)
        correlations = 1 - (means[: len(lags)] + _FLOOR) / (within + _FLOOR)
        return np.array([means[0], *correlations, means[len(lags) - 1] - means[0]])

    pair, *shown, rise = jackknife(blocks, plain)
    memory = None
    correlation = tuple(shown)
    remembered = rise.low > 0 and shown[0].low > LEAST_CORRELATION
    if times >= LEAST_MEMORY_FRAMES and remembered:
        cosines = Cosines.of(taken_at)
        modes = _blocks(np.moveaxis(cosines.squares(values), 0, -1))
        covered = (rows - rows % min(_BLOCKS, rows // 2)) * (columns - columns % min(_BLOCKS, columns // 2))
        mixture = fit_mixture(modes, (rows - 1) * (columns - 1) * covered / (rows * columns), cosines)
        within, staying = jackknife(blocks[:, -2:], lambda means: means)
        memory = memory_of(mixture, rate_hz, cosines, within, staying)
        correlation = tuple(mixture.measured(partial(_correlation, lag)) for lag in lags)
    differences = tuple(root(float(blocks[:, i].mean())) for i in range(len(lags)))
    return Temporal(pair.map(root), lags, differences, correlation, memory)


def memory_of(mixture: Mixture, rate_hz: float, cosines: Cosines, within: Measured, staying: Measured) -> Memory:
    """Of a mixture that is made of these cosines, in frames of the camera at `rate_hz`; within and staying are the
    variance about the mean of the frames, and that of the mean."""
    white = mixture.measured(lambda variances, _: variances[0])
    correlated = mixture.measured(_correlated)
    total = mixture.measured(lambda variances, _: variances[0] + variances[1] + variances[2])
    log_decay = mixture.measured(lambda _, log_decay: log_decay)
    walk = partial(_growing, _OF_LENGTH * mixture.length) if mixture.walks else _walk
    left = mixture.measured(partial(_mean, cosines.constant))
    fixed = without(staying, left)
    if mixture.slowest:
        # It may last for any longer: of what stays over the recording nobody can tell it from fixed pattern.
        log_decay = replace(log_decay, low=-math.inf)
        correlated, total = (
            replace(each, low=min(each.low, within.value), high=each.high + staying.value)
            for each in (correlated, total)
        )
        fixed = replace(fixed, low=0.0, high=max(fixed.high, staying.value))
        left = replace(left, low=0.0, high=math.inf)  # after `fixed`, which takes its value and has ends of its own
    return Memory(
        white=white.map(root),
        correlated=correlated.map(root),
        total=total.map(root),
        rho=log_decay.map(lambda x: math.exp(-math.exp(x))),
        time_constant_s=log_decay.map(lambda x: math.exp(-x) / rate_hz),
        age_s=_age(mixture) / rate_hz,
        walk=mixture.measured(walk).map(lambda a_frame: root(a_frame * rate_hz)),
        left=left.map(root),
        fixed=fixed.map(root),
    )


def _correlated(variances: Floats, log_decay: float) -> float:
    """Variance that noise with memory tends to."""
    return float(variances[1] + variances[2])


def _age(mixture: Mixture) -> float:
    """Frames since a correction: of X[k] - rho^(k + a) X[-a] a share rho^(2 a) has none before the first frame."""
    _, lasting, grown, _, _ = mixture.best.variances
    if grown == 0:
        return math.inf
    return math.log(1 + lasting / grown) / (2 * math.exp(mixture.best.log_decay))


def _walk(variances: Floats, log_decay: float) -> float:
    return float(variances[3])


def _growing(lag: float, variances: Floats, log_decay: float) -> float:
    """What the change over `lag` frames grows by in variance, a frame, from half of them on: by a walk and by AR(1)
    noise that is no faster, as if it were always there (of noise that grows, this is too much by half where it takes
    no longer than the lag)."""
    far = math.exp(log_decay) * lag
    return float(variances[3]) + _correlated(variances, log_decay) * (math.exp(-far / 2) - math.exp(-far)) * 4 / lag


def _correlation(lag: int, variances: Floats, log_decay: float) -> float:
    correlated = _correlated(variances, log_decay)
    return correlated / max(float(variances[0]) + correlated, _FLOOR) * math.exp(-math.exp(log_decay) * lag)


def _mean(constant: Cosines, variances: Floats, log_decay: float) -> float:
    """Variance of the mean of the frames, by their `constant` mode: but for fixed pattern, and of what walks since the
    first frame."""
    return float(parts_at(log_decay, constant)[0, :-1] @ variances[:-1]) / len(constant.ages)


def time_freedom(memory: Memory | None, number: Indices) -> float:
    """Degrees of freedom of a series about its mean, of frames taken at `number` (T,), in frames of the camera.

    (tr R)^2 / tr R^2 of the centred correlation matrix R: F. E. Satterthwaite, "An approximate
    distribution of estimates of variance components", Biometrics Bulletin 2 (1946). Both are told by the sums of rows
    of the matrix before it is centred, and by the sum of its squares.
    """
    count = len(number)
    if memory is None or not memory.total.value:
        return count - 1
    share = (memory.correlated.value / memory.total.value) ** 2
    ages = number - number[0]
    apart = np.abs(np.arange(-ages[-1], ages[-1] + 1))
    correlation = share * memory.rho.value**apart + (1 - share) * (apart == 0)
    seen = np.bincount(ages).astype(np.float64)
    rows, squares = (np.convolve(seen, values, "valid")[ages] for values in (correlation, correlation**2))
    mean = rows.sum() / count
    return float((count - mean) ** 2 / (squares.sum() - 2 / count * rows @ rows + mean**2))


def centred(values: Floats) -> Floats:
    """Each frame less its row and column means, (T, rows, columns), and with the variance of white noise again that
    this took."""
    rows, columns = values.shape[1:]
    level = values.mean(axis=(1, 2), keepdims=True)
    centred: Floats = values - values.mean(axis=1, keepdims=True) - values.mean(axis=2, keepdims=True) + level
    return centred * math.sqrt(rows * columns / ((rows - 1) * (columns - 1)))


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


def _blocks(pictures: Floats) -> Floats:
    """Means over a grid of up to 6 x 6 equal blocks of (rows, columns, ...); what is over at the ends is left."""
    rows, columns = pictures.shape[:2]
    down, across = min(_BLOCKS, rows // 2), min(_BLOCKS, columns // 2)
    high, wide = rows // down, columns // across
    cut = pictures[: down * high, : across * wide].reshape(down, high, across, wide, -1)
    means: Floats = cut.mean(axis=(1, 3)).reshape(down * across, -1)
    return means
