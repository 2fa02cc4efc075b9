"""Estimates with 95 % intervals, and checks of arguments.

Intervals are those of the delete-one jackknife for means over blocks of pixels (B. Efron, "The Jackknife, the Bootstrap
and Other Resampling Plans", 1982, section 3), of the chi-square distribution for variances of Gaussian values, and of
the Poisson distribution for numbers of events (F. Garwood, Biometrika 28, 1936).
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError, counted, is_number
from irsim.types import Bools, Floats, Indices

Values = npt.NDArray[np.floating] | npt.NDArray[np.integer] | npt.NDArray[np.integer | np.floating]
"""Array of counts, or of values in any unit."""

LEVEL = 0.95
ROUNDING = 1 / 12
"""Variance of rounding to whole counts, which every measured white noise includes."""
ROUNDED = math.hypot(0.3, math.sqrt(ROUNDING))
"""Sigma, counts, that is measured for noise of 0.3 counts. For weaker noise it depends on where the mean lies between
two counts (B. Widrow, I. Kollar, "Quantization Noise", 2008, section 5.2)."""
_HIDDEN = 0.4
"""Largest true sigma, counts, of noise whose measured sigma may lie below `ROUNDED`."""
LEAST_FRAMES = 4
LEAST_SIDE = 4
_ALLOWED = "allowed: an array of whole numbers, float32 or float64, (frames, rows, columns)"


@dataclass(frozen=True, slots=True)
class Estimate:
    """Value with the ends of its 95 % interval. `bound` is True where only the upper end is known; `low` is then 0."""

    value: float
    low: float
    high: float
    bound: bool = field(default=False, kw_only=True)

    def as_json(self) -> list[float | None]:
        """Return value, low and high end, with None for an infinite end."""
        return [self.value, *(end if math.isfinite(end) else None for end in (self.low, self.high))]

    def map(self, function: Callable[[float], float]) -> Estimate:
        """Return the estimate of a monotonic function of this value."""
        low, high = sorted((function(self.low), function(self.high)))
        return Estimate(function(self.value), low, high, bound=self.bound)


def exact(value: float) -> Estimate:
    """Return the estimate of a value that is known exactly."""
    return Estimate(value, value, value)


def square(sigma: float) -> float:
    return sigma**2


def root(variance: float) -> float:
    """Return the square root of an estimated variance; 0 for a negative one."""
    return math.sqrt(max(variance, 0.0))


def subtract_variance(whole: Estimate, part: Estimate) -> Estimate:
    """Return a variance less the variance of an independent part. Errors on either side add in squares."""
    value = whole.value - part.value
    down = math.hypot(whole.value - whole.low, part.high - part.value)
    up = math.hypot(whole.high - whole.value, part.value - part.low)
    return Estimate(value, value - down, value + up, bound=whole.bound)


def subtract(sigma: Estimate, variance: Estimate) -> Estimate:
    """Return the sigma that remains when the variance of a part is subtracted. Where nothing is left, the interval
    reaches up to the whole sigma."""
    rest = subtract_variance(sigma.map(square), variance).map(root)
    return rest if rest.high > 0 else replace(rest, high=sigma.high)


def remove_rounding(sigma: Estimate, hidden: bool) -> Estimate:
    """Return a measured sigma of white noise less the variance of rounding, with `hidden` as in `may_be_hidden`."""
    return may_be_hidden(subtract(sigma, exact(ROUNDING)), hidden)


def may_be_hidden(sigma: Estimate, hidden: bool) -> Estimate:
    """Return a sigma. If `hidden`, its interval runs from 0 to the largest sigma that rounding can hide, or further."""
    return replace(sigma, low=0.0, high=max(sigma.high, _HIDDEN)) if hidden else sigma


def hull(middle: Estimate, found: list[Estimate]) -> Estimate:
    """Return the value of `middle`, with an interval that covers the intervals of all estimates in `found`."""
    return Estimate(middle.value, min(one.low for one in found), max(one.high for one in found))


def chi_square(value: float, freedom: float) -> Estimate:
    """Return a variance that is estimated by a mean square with `freedom` degrees of freedom."""
    from scipy.stats import chi2

    low, high = (value * freedom / float(chi2.ppf(end, freedom)) for end in ((1 + LEVEL) / 2, (1 - LEVEL) / 2))
    return Estimate(value, low, high)


def poisson(count: float) -> tuple[float, float]:
    """Return the interval of a Poisson distribution's mean, given one observed count."""
    from scipy.stats import chi2

    low = float(chi2.ppf((1 - LEVEL) / 2, 2 * count)) / 2 if count else 0.0
    return low, float(chi2.ppf((1 + LEVEL) / 2, 2 * count + 2)) / 2


def exponential_mean(total: float, count: int) -> Estimate:
    """Return the mean of `count` exponential values from their sum, which includes censored values."""
    low, high = poisson(count)
    return Estimate(total / count, total / high, total / low)


def order_median(values: Floats) -> Estimate:
    """Return the median of values (N,) with the interval of order statistics (W. R. Thompson, 1936)."""
    from scipy.stats import binom

    ordered, count = np.sort(values), len(values)
    inner = int(binom.ppf((1 - LEVEL) / 2, count, 0.5))
    low, high = max(inner - 1, 0), min(count - inner, count - 1)
    return Estimate(float(np.median(ordered)), float(ordered[low]), float(ordered[high]))


def jackknife(blocks: Floats, statistic: Callable[[Floats], Floats]) -> list[Estimate]:
    """Return the estimates of a statistic of the mean over blocks, with the interval of Student's t distribution.

    blocks      (B, ...) each the mean over equally many values, independent of the other blocks
    statistic   function of the mean over blocks (...) that returns (S,) values
    """
    from scipy.stats import t

    count = len(blocks)
    total = blocks.sum(axis=0)
    whole = statistic(total / count)
    left = np.stack([statistic((total - block) / (count - 1)) for block in blocks])
    error = np.sqrt((count - 1) / count * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
    reach = float(t.ppf((1 + LEVEL) / 2, count - 1)) * error
    return [Estimate(float(v), float(v - r), float(v + r)) for v, r in zip(whole, reach, strict=True)]


def spatial_blocks(pictures: Floats) -> Floats:
    """Return the means of (rows, columns, ...) over a grid of up to 6 x 6 equal blocks, (blocks, ...)."""
    rows, columns = pictures.shape[:2]
    down, across = min(6, rows // 2), min(6, columns // 2)
    high, wide = rows // down, columns // across
    cut = pictures[: down * high, : across * wide].reshape(down, high, across, wide, *pictures.shape[2:])
    means: Floats = cut.mean(axis=(1, 3)).reshape(down * across, *pictures.shape[2:])
    return means


def center_lines(values: Floats) -> Floats:
    """Return frames (T, rows, columns) less their row and column means, scaled to keep the variance of white noise."""
    rows, columns = values.shape[1:]
    level = values.mean(axis=(1, 2), keepdims=True)
    centred: Floats = values - values.mean(axis=1, keepdims=True) - values.mean(axis=2, keepdims=True) + level
    return centred * math.sqrt(rows * columns / ((rows - 1) * (columns - 1)))


def whole_counts(frames: Values) -> bool:
    """Return True for whole numbers, whose noise includes that of rounding."""
    return np.issubdtype(frames.dtype, np.integer) or all(bool((frame == np.rint(frame)).all()) for frame in frames)


def evenly(count: int, most: int) -> Indices:
    """Return up to `most` indices, evenly spaced from 0 to count - 1."""
    found: Indices = np.unique(np.linspace(0, count - 1, most).astype(np.intp))
    return found


def check_measurable(frames: object, rate_hz: object, top: object, taken: object, times: object) -> None:
    """Raise InputError for invalid frames, frame rate, highest count, target mask or frame times."""
    count, *size = check_frames(frames).shape
    check_positive(rate_hz, "rate_hz", "frames a second")
    check_positive(top, "top", "the highest possible count")
    check_mask(taken, tuple(size))
    if times is not None and not (
        isinstance(times, np.ndarray)
        and times.dtype.kind in "iuf"
        and times.shape == (count,)
        and np.isfinite(times).all()
        and (times[1:] >= times[:-1]).all()
    ):
        raise InputError(
            f"times: {_kind(times)}; allowed: None, or an array of numbers of shape ({count},) that do not fall, s"
        )


def check_frames(frames: object) -> npt.NDArray[Any]:
    """Return the frames. Raises InputError unless they are an array (T, rows, columns) of finite numbers."""
    if isinstance(frames, np.ma.MaskedArray):
        raise InputError(f"frames: a masked array, whose mask would be lost; {_ALLOWED}, such as frames.filled(...)")
    numeric = isinstance(frames, np.ndarray) and (
        frames.dtype.kind in "iu" or frames.dtype.type in (np.float32, np.float64)
    )
    if not (isinstance(frames, np.ndarray) and numeric and frames.ndim == 3):
        raise InputError(f"frames: {_kind(frames)}; {_ALLOWED}")
    if frames.size == 0:
        raise InputError(f"frames: {_kind(frames)}; allowed: one or more frames of one or more pixels")
    if frames.dtype.kind == "f":
        wrong = [number for number, frame in enumerate(frames) if not np.isfinite(frame).all()]
        if wrong:
            raise InputError(
                f"frames: {len(wrong)} of {len(frames)} hold values that are not finite, frame {wrong[0]} first; "
                "allowed: finite numbers"
            )
    return frames


def check_size(frames: Values) -> None:
    """Raise InputError where frames (T, rows, columns) are too few or too small to measure noise."""
    times, rows, columns = frames.shape
    if times < LEAST_FRAMES:
        few = f"{counted(times, 'frame')} {'is' if times == 1 else 'are'} too few"
        raise InputError(f"{few} to measure noise; allowed: at least {LEAST_FRAMES}")
    if min(rows, columns) < LEAST_SIDE:
        raise InputError(
            f"a region of {columns}x{rows} px is too small to measure noise; "
            f"allowed: at least {LEAST_SIDE}x{LEAST_SIDE}"
        )


def check_mask(taken: object, size: tuple[int, ...]) -> None:
    """Raise InputError unless `taken` is None or a mask of `size` (rows, columns)."""
    if taken is not None and not (isinstance(taken, np.ndarray) and taken.dtype == np.bool_ and taken.shape == size):
        raise InputError(f"taken: {_kind(taken)}; allowed: None, or an array of bool of shape {size} (rows, columns)")


def check_positive(given: Any, name: str, meaning: str) -> None:
    """Raise InputError unless `given` is a finite number above 0; the argument named `top` may be infinite."""
    if not (is_number(given) and float(given) > 0 and (name == "top" or math.isfinite(given))):
        raise InputError(f"{name} {reprlib.repr(given)}: allowed: a number above 0, {meaning}")


def frame_numbers(given: object, count: int) -> Indices:
    """Return the camera's frame numbers of `count` frames, by default 0, 1, 2 ... Raises InputError where they do not
    rise, or no two are consecutive."""
    if given is None:
        return np.arange(count)
    if not (
        isinstance(given, np.ndarray)
        and given.dtype.kind in "iu"
        and given.shape == (count,)
        and (given[1:] > given[:-1]).all()
        and (np.diff(given) == 1).any()
    ):
        raise InputError(
            f"number: {_kind(given)}; allowed: None, or an array of whole numbers of shape ({count},) that rise, "
            "somewhere by 1"
        )
    return given.astype(np.intp)


def clipped(values: Values, frames: Values, top: float) -> Bools:
    """Return the mask of values at 0 or at `top`; all False for frames that are not raw counts."""
    if not whole_counts(frames) or frames.min() < 0:
        return np.zeros(values.shape, np.bool_)
    ends: Bools = (values <= 0) | (values >= top)
    return ends


def _kind(given: object) -> str:
    if isinstance(given, np.ndarray):
        return f"an array of {given.dtype} of shape {given.shape}"
    return f"a {type(given).__name__}"
