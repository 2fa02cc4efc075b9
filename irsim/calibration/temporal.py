"""Noise over time: white noise, first-order autoregressive noise and drift of pixels, rows and columns.

The structure function D(k), half of the mean squared difference of frames k apart, contains no fixed pattern. For white
noise of variance w, AR(1) noise of variance s and correlation rho from frame to frame, and a random walk whose variance
grows by d in each frame,

  D(k) = w + s (1 - rho^k) + d k / 2

(N. A. C. Cressie, "Statistics for Spatial Data", 1993, section 2.4; the Allan variance is a mean of the same
differences). The variances are fitted by weighted non-negative least squares over a grid of rho, with intervals by the
jackknife over blocks of pixels. The walk represents any drift with a time constant far longer than the recording.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from irsim.calibration.statistics import (
    Estimate,
    Values,
    center_lines,
    check_frames,
    check_positive,
    check_size,
    frame_numbers,
    hull,
    jackknife,
    root,
    spatial_blocks,
)
from irsim.types import Floats, Indices

LAGS = (1, 2, 3, 5, 9, 18, 36, 72)
LEAST_MEMORY_FRAMES = 12
LEAST_CORRELATION = 0.02
"""Correlation from frame to frame below which pixel noise counts as white. Cooled cameras show ±0.01 at most."""
LINE_CORRELATION = 0.3
"""Correlation below which noise of rows, columns and the level counts as white; these are fewer than pixels."""
_LINE_BLOCKS = 12
_FIT_LAGS = 12
_SLOWEST = 3.0
"""Longest time constant of the grid, in durations of the recording."""
_SEPARABLE = 1 / 6
"""Time constant, in durations of the recording, above which correlated noise and drift cannot be distinguished."""
_FASTEST = 0.33
"""Shortest time constant of the grid, frames. Its correlation from frame to frame is 0.05."""
_GRID = 20


@dataclass(frozen=True)
class Memory:
    """White, AR(1) and drifting noise of pixels, rows or columns, as sigmas in the units of the frames.

    white, correlated       sigmas of the white part and of the AR(1) part
    total                   sigma of both parts together
    rho, time_constant_s    correlation of the AR(1) part from frame to frame, and time in which it falls to 1/e
    walk                    sigma of the change by drift in a second; it grows as the root of time
    left                    sigma that all three parts leave in the mean of the frames
    fixed                   sigma of the fixed pattern: that of the mean of the frames, less `left`
    """

    white: Estimate
    correlated: Estimate
    total: Estimate
    rho: Estimate
    time_constant_s: Estimate
    walk: Estimate
    left: Estimate
    fixed: Estimate

    @property
    def drift(self) -> Estimate | None:
        """`walk` where it is significant, else None."""
        return self.walk if self.walk.low > 0 else None


@dataclass(frozen=True)
class Temporal:
    """Noise of pixels over time.

    pair            sigma of differences of neighbouring frames, divided by sqrt(2)
    lags            lags, frames of the camera
    difference      square root of the structure function at each lag
    correlation     correlation of the noise at each lag
    memory          fitted parts of the noise; None where it is white or the frames are too few
    """

    pair: Estimate
    lags: tuple[int, ...]
    difference: tuple[float, ...]
    correlation: tuple[Estimate, ...]
    memory: Memory | None


def temporal_noise(frames: Values, rate_hz: float, number: Indices | None = None) -> Temporal:
    """Return the noise of pixels over time in frames (T, rows, columns) of a flat scene.

    number  (T,) frame numbers of the camera at `rate_hz`; default: 0, 1, 2 ...

    Raises InputError for frames that are too few, too small or not finite, for a rate that is not positive, and for
    numbers that do not rise.
    """
    check_frames(frames)
    check_size(frames)
    check_positive(rate_hz, "rate_hz", "frames a second")
    values = center_lines(np.asarray(frames, np.float64))
    count = len(values)
    taken_at = frame_numbers(number, count)
    lags = [lag for lag in LAGS if lag == 1 or (lag <= count // 2 and _pairs(taken_at, lag)[0].size >= count / 4)]
    pictures = [_structure(values, taken_at, lag) for lag in lags] + [values.var(axis=0, ddof=1)]
    blocks = spatial_blocks(np.stack(pictures, axis=-1))

    def statistics(means: Floats) -> Floats:
        correlations = 1 - means[: len(lags)] / max(means[-1], 1e-300)
        return np.array([means[0], *correlations, means[len(lags) - 1] - means[0]])

    pair, *correlation, rise = jackknife(blocks, statistics)
    memory = None
    if count >= LEAST_MEMORY_FRAMES and rise.low > 0 and correlation[0].low > LEAST_CORRELATION:
        fit_lags = _fit_lags(taken_at)
        pictures = [_structure(values, taken_at, lag) for lag in fit_lags] + [np.square(values.mean(axis=0))]
        memory = _fit_memory(spatial_blocks(np.stack(pictures, axis=-1)), fit_lags, taken_at, rate_hz)
        share = (memory.correlated.value / memory.total.value) ** 2 if memory.total.value else 0.0
        correlation = [_model_correlation(memory, lag, share) for lag in lags]
    differences = tuple(root(float(blocks[:, place].mean())) for place in range(len(lags)))
    return Temporal(pair.map(root), tuple(lags), differences, tuple(correlation), memory)


def line_memories(frames: Floats, number: Indices, rate_hz: float, sigmas: dict[str, Estimate]) -> dict[str, Memory]:
    """Return the noise over time of rows ("tv") and of columns ("th"), as far as it is correlated.

    sigmas  sigmas of both terms, without the part of pixel noise in the mean of a line
    """
    found: dict[str, Memory] = {}
    if _pairs(number, 1)[0].size < LEAST_MEMORY_FRAMES:
        return found
    pixels, level = center_lines(frames), frames.mean(axis=(1, 2))[:, None]
    for term, axis in (("tv", 2), ("th", 1)):
        sigma = sigmas[term]
        series = frames.mean(axis=axis) - level
        series = series * math.sqrt(series.shape[1] / (series.shape[1] - 1))
        theirs = pixels if term == "tv" else pixels.swapaxes(1, 2)
        own = _covariance(series, number) - _covariance(theirs.reshape(len(theirs), -1), number) / theirs.shape[2]
        if sigma.low > 0 and own > LINE_CORRELATION * sigma.value**2:
            found[term] = _fit_lines(series, theirs, number, rate_hz)
    return found


def time_freedom(memory: Memory | None, number: Indices) -> float:
    """Return the degrees of freedom of a series about its mean at frame numbers (T,).

    They are (tr R)^2 / tr R^2 of the centred correlation matrix R (F. E. Satterthwaite, Biometrics Bulletin 2, 1946).
    """
    count = len(number)
    if memory is None or not memory.total.value:
        return count - 1
    share = (memory.correlated.value / memory.total.value) ** 2
    apart = np.abs(np.subtract.outer(number, number))
    correlation = share * memory.rho.value**apart + (1 - share) * (apart == 0)
    centred = correlation - correlation.mean(axis=0) - correlation.mean(axis=1)[:, None] + correlation.mean()
    return float(np.trace(centred) ** 2 / np.square(centred).sum())


def _fit_lines(series: Floats, pixels: Floats, number: Indices, rate_hz: float) -> Memory:
    """Return the noise of lines from their means, series (T, lines), less the noise that averaging the N pixels of
    each line, pixels (T, lines, N), leaves in the mean."""
    lags = _fit_lags(number)
    columns = []
    for lag in lags:
        theirs = _structure(pixels.reshape(len(pixels), -1), number, lag).mean() / pixels.shape[2]
        columns.append(_structure(series, number, lag) - theirs)
    columns.append(np.square(series.mean(axis=0)) - np.square(pixels.mean(axis=0)).mean() / pixels.shape[2])
    lines = np.stack(columns, axis=-1)
    parts = min(_LINE_BLOCKS, len(lines))
    size = len(lines) // parts
    blocks = lines[: parts * size].reshape(parts, size, -1).mean(axis=1)
    return _fit_memory(blocks, lags, number, rate_hz)


def _fit_memory(blocks: Floats, lags: Indices, number: Indices, rate_hz: float) -> Memory:
    """Fit the noise model to the structure function at `lags` and the square of the mean, in blocks (B, lags + 1)."""
    ages = (number - number[0]).astype(np.float64)
    apart = np.abs(np.subtract.outer(ages, ages))
    length = ages[-1] + 1
    grid = np.geomspace(_FASTEST, _SLOWEST * length, _GRID)
    weights = np.sqrt((len(number) - lags).clip(1) / lags) / blocks[:, :-1].mean(axis=0).clip(1e-300)

    def mean_variance(parts: Floats, time: float) -> float:
        lasting = float(np.exp(-apart / time).mean())
        walked = float(np.minimum.outer(ages, ages).mean())
        return float(parts @ [1 / len(number), lasting, walked])

    def statistic(means: Floats, drifts: bool = True, longest: float = math.inf) -> Floats:
        times = grid[: max(int(np.searchsorted(grid, longest)), 2)]
        parts, time = _least_squares(means[:-1], lags, weights, times, drifts)
        left = mean_variance(parts, time)
        return np.array([*parts, parts[0] + parts[1], math.log(time), left, means[-1] - left])

    found = jackknife(blocks, statistic)
    if found[2].low <= 0:  # no significant walk: values from the fit without it, intervals from both
        without = jackknife(blocks, lambda means: statistic(means, drifts=False))
        models = [without, found]
        if without[4].high > math.log(_SEPARABLE * length):
            models.append(jackknife(blocks, lambda means: statistic(means, longest=_SEPARABLE * length)))
        found = [hull(models[0][place], [model[place] for model in models]) for place in range(len(found))]
    white, correlated, walk, total, log_time, left, fixed = found
    if log_time.high > math.log(length) and correlated.value > 0:
        # Noise as slow as the recording cannot be separated from fixed pattern.
        staying = float(blocks[:, -1].mean())
        log_time = replace(log_time, high=math.inf)
        correlated, total = (replace(each, high=each.high + max(staying, 0.0)) for each in (correlated, total))
        fixed = replace(fixed, low=0.0, high=max(fixed.high, staying))
    time_s = log_time.map(lambda log: math.exp(log) / rate_hz if log < 700 else math.inf)
    return Memory(
        white=white.map(root),
        correlated=correlated.map(root),
        total=total.map(root),
        rho=time_s.map(lambda time: math.exp(-1 / (time * rate_hz)) if time * rate_hz > 1e-2 else 0.0),
        time_constant_s=time_s,
        walk=walk.map(lambda a_frame: root(a_frame * rate_hz)),
        left=left.map(root),
        fixed=fixed.map(root),
    )


def _least_squares(
    structure: Floats, lags: Indices, weights: Floats, grid: Floats, drifts: bool
) -> tuple[Floats, float]:
    """Return variances (3,) of the white, AR(1) and walking part, and the time constant of the AR(1) part, frames."""
    from scipy.optimize import minimize_scalar, nnls

    def solve(log_time: float) -> tuple[Floats, float]:
        lasting = -np.expm1(-lags / math.exp(log_time))
        parts = np.stack([np.ones(len(lags)), lasting, lags / 2 * drifts], axis=1)
        found, residual = nnls(parts * weights[:, None], structure * weights)
        return found, float(residual)

    logs = np.log(grid)
    place = int(np.argmin([solve(log)[1] for log in logs]))
    ends = logs[max(place - 1, 0)], logs[min(place + 1, len(logs) - 1)]
    best = float(minimize_scalar(lambda log: solve(log)[1], bounds=ends, options={"xatol": 1e-4}).x)
    return solve(best)[0], math.exp(best)


def _fit_lags(number: Indices) -> Indices:
    """Return lags with enough pairs of frames, evenly spaced in log lag up to half of the recording."""
    length = int(number[-1] - number[0])
    lags = np.unique(np.geomspace(1, max(length // 2, 3), _FIT_LAGS).round().astype(np.intp))
    return np.array([lag for lag in lags if _pairs(number, int(lag))[0].size >= max(len(number) // 8, 2)] or [1])


def _pairs(number: Indices, lag: int) -> tuple[Indices, Indices]:
    """Return the indices of the earlier and the later frames of all pairs that are `lag` apart."""
    later = np.searchsorted(number, number + lag).clip(max=len(number) - 1)
    first = np.flatnonzero(number[later] == number + lag)
    return first, later[first]


def _structure(values: Floats, number: Indices, lag: int) -> Floats:
    """Return half of the mean squared difference over a lag, (...), of values (T, ...)."""
    total = np.zeros(values.shape[1:])
    first, later = _pairs(number, lag)
    for one, other in zip(first, later, strict=True):
        total += np.square(values[other] - values[one])
    return total / (2 * max(len(first), 1))


def _covariance(series: Floats, number: Indices) -> float:
    """Return the covariance between neighbouring frames of series (T, N) about their means."""
    series = series - series.mean(axis=0)
    first, later = _pairs(number, 1)
    return float(np.mean(series[first] * series[later]))


def _model_correlation(memory: Memory, lag: int, share: float) -> Estimate:
    """Return the correlation of the fitted noise model at a lag."""
    low, high = (
        min((part / total) ** 2, 1.0) * rho**lag if total else 0.0
        for part, total, rho in (
            (memory.correlated.low, memory.total.low, memory.rho.low),
            (memory.correlated.high, memory.total.high, memory.rho.high),
        )
    )
    value = share * memory.rho.value**lag
    return Estimate(value, min(low, value), max(high, value))
