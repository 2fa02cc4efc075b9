"""A measured value with the interval in which the true one lies."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from irsim.types import Floats

LEVEL = 0.95
"""How often an interval holds the true value."""
ENDS = 1.96
"""Standard errors from a value to the ends of its interval where errors are normal: Phi^-1((1 + LEVEL) / 2)."""


@dataclass(frozen=True, slots=True)
class Measured:
    """A value and the ends of its 95 % interval.

    bound   whether only an upper bound is known: the true value may be anything up to `high`, and `low` is 0
    """

    value: float
    low: float
    high: float
    bound: bool = field(default=False, kw_only=True)

    def as_json(self) -> list[float | None]:
        """Value, low and high; None for an end that there is none of, as JSON has no infinity."""
        return [self.value, *(end if math.isfinite(end) else None for end in (self.low, self.high))]

    def map(self, function: Callable[[float], float]) -> Measured:
        """Each number through a rising or falling function, a bound through a rising one; low stays the lower end."""
        low, high = sorted((function(self.low), function(self.high)))
        return Measured(function(self.value), low, high, bound=self.bound)


def without(whole: Measured, part: Measured) -> Measured:
    """A variance less that of a part of it; their errors, taken as independent, add up in squares on either side."""
    value = whole.value - part.value
    down = math.hypot(whole.value - whole.low, part.high - part.value)
    up = math.hypot(whole.high - whole.value, part.value - part.low)
    return Measured(value, value - down, value + up, bound=whole.bound)


def less(sigma: Measured, part: Measured) -> Measured:
    """A sigma without a part of its variance; where nothing is left, it may be anything up to the whole."""
    rest = without(sigma.map(square), part).map(root)
    return rest if rest.high > 0 else replace(rest, high=sigma.high)


def exactly(value: float) -> Measured:
    """A value that is known."""
    return Measured(value, value, value)


def chi_square(value: float, freedom: float) -> Measured:
    """A variance by a mean square of so many independent normal values, with the ends of a chi-square."""
    from scipy.stats import chi2

    low, high = (value * freedom / float(chi2.ppf(end, freedom)) for end in ((1 + LEVEL) / 2, (1 - LEVEL) / 2))
    return Measured(value, low, high)


def mean_square(squares: Floats) -> Measured:
    """A variance by (N,) squares of values less their mean: with a chi-square's ends, which few normal values need, or
    a jackknife's, which others do, whichever is farther out."""
    found = jackknife(squares[:, None], lambda mean: mean)[0]
    normal = chi_square(found.value, len(squares) - 1)
    return Measured(found.value, min(found.low, normal.low), max(found.high, normal.high))


def square(sigma: float) -> float:
    """The variance of a sigma."""
    return sigma**2


def root(value: float) -> float:
    """The square root of a variance that was estimated, and may have come out below 0."""
    return math.sqrt(max(value, 0.0))


def jackknife(blocks: Floats, statistic: Callable[[Floats], Floats]) -> list[Measured]:
    """What `statistic` says of the mean of all blocks, with intervals from leaving out one by one.

    blocks      (B, ...) each the mean over as much data, independent of the others
    statistic   mean over blocks (...) -> (S,)

    The interval is that of Student's t with B - 1 degrees of freedom about the full-sample value:
    B. Efron, "The Jackknife, the Bootstrap and Other Resampling Plans" (1982), section 3.
    """
    from scipy.stats import t

    count = len(blocks)
    total = blocks.sum(axis=0)
    whole = statistic(total / count)
    left = np.stack([statistic((total - block) / (count - 1)) for block in blocks])
    error = np.sqrt((count - 1) / count * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
    reach = float(t.ppf((1 + LEVEL) / 2, count - 1)) * error
    return [Measured(float(v), float(v - r), float(v + r)) for v, r in zip(whole, reach, strict=True)]
