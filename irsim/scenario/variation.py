"""Variations: the distributions of values under `vary`, to draw from and to search.

A variation returns a value for a quantile from 0 to 1: a Monte Carlo draw uses a uniform quantile, and a search moves
in the cube of quantiles. It also returns a value for an integer severity. Severity 0 is the benign value, each step
leads farther from it, and a search shrinks failures towards 0.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from statistics import NormalDist
from typing import Annotated, Any

from pydantic import Field, model_validator

from irsim.config.base import Family, Kind, invalid
from irsim.config.quantities import LARGEST, Number, Positive

STEPS = 5
"""Number of severities from the benign value to an end of the interval."""

_BETWEEN = math.pi / 10
"""Quantile that is validated besides the ends: few distributions yield an integer there, so keys that need one are
detected."""

CUT_SD = 4.0
"""Default ends of a normal distribution, in standard deviations. Truncation there lowers its deviation by 0.05 %."""


class Variation(Kind):
    """Range of values of one key."""

    benign: Any = None
    """Value at severity 0; default: the value of the scenario."""
    nuisance: bool = False
    """True if the value follows from the scene's seed and is not searched."""

    @abstractmethod
    def quantile(self, share: float) -> Any:
        """Return the value at quantile `share`, from 0 to 1."""

    @abstractmethod
    def probes(self) -> dict[tuple[str | int, ...], Any]:
        """Return values to validate, including both ends, by key path for error messages."""

    @abstractmethod
    def severities(self, benign: Any) -> range:
        """Return all severities. Negative ones lead to the low end if `benign` lies between the ends."""

    @abstractmethod
    def at_severity(self, severity: int, benign: Any) -> Any:
        """Return the value at a severity, one of `severities`."""

    def misfit(self, benign: Any) -> str | None:
        """Return the reason why the benign value does not fit the variation; None if it fits."""
        return None


class Span(Variation):
    """Numbers between two ends."""

    @property
    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """Least and greatest value, (low, high)."""

    def probes(self) -> dict[tuple[str | int, ...], Any]:
        low, high = self.ends
        return {("kind",): self.quantile(_BETWEEN), ("low",): low, ("high",): high}

    def between(self, start: float, end: float, share: float) -> float:
        """Return the value at fraction `share` of the way from `start` to `end`. Severities are equal steps."""
        return start + (end - start) * share

    def severities(self, benign: Any) -> range:
        low, high = self.ends
        return range(-STEPS if low < benign < high else 0, STEPS + 1)

    def at_severity(self, severity: int, benign: Any) -> Any:
        if severity == 0:
            return benign
        low, high = self.ends
        start = min(max(float(benign), low), high)
        end = low if severity < 0 or start == high else high
        return self.between(start, end, abs(severity) / STEPS)

    def misfit(self, benign: Any) -> str | None:
        if isinstance(benign, int | float) and not isinstance(benign, bool):
            return None
        return "the scenario has no number here to begin from; allowed: a number there, or the key benign"

    @model_validator(mode="after")
    def _ends_rise(self) -> Span:
        low, high = self.ends
        if low >= high:
            raise invalid(f"{low:g} is not below {high:g}; allowed: low below high", at=("low",))
        return self


class Uniform(Span):
    """Any number between two ends, uniformly distributed."""

    low: Number
    """Least value."""
    high: Number
    """Greatest value."""

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def quantile(self, share: float) -> float:
        return self.between(self.low, self.high, share)


class LogUniform(Uniform):
    """Any number between two ends, uniformly distributed in its logarithm."""

    low: Positive
    """Least value."""
    high: Positive
    """Greatest value."""

    def between(self, start: float, end: float, share: float) -> float:
        return float(start * (end / start) ** share) if share < 1 else end


class Integers(Span):
    """A whole number between two ends, uniformly distributed."""

    low: Annotated[int, Field(ge=-LARGEST, le=LARGEST)]
    """Least value."""
    high: Annotated[int, Field(ge=-LARGEST, le=LARGEST)]
    """Greatest value, included."""

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def quantile(self, share: float) -> int:
        return min(self.low + math.floor(share * (self.high - self.low + 1)), self.high)

    def between(self, start: float, end: float, share: float) -> int:
        return round(super().between(start, end, share))


class Normal(Span):
    """Normally distributed numbers between two ends."""

    mean: Number
    """Mean before truncation."""
    sd: Positive
    """Standard deviation before truncation."""
    low: Number | None = None
    """Least value; default: 4 standard deviations below the mean."""
    high: Number | None = None
    """Greatest value; default: 4 standard deviations above the mean."""

    @property
    def ends(self) -> tuple[float, float]:
        low = self.mean - CUT_SD * self.sd if self.low is None else self.low
        return low, self.mean + CUT_SD * self.sd if self.high is None else self.high

    @property
    def _shares(self) -> tuple[float, float]:
        """Fractions of the untruncated distribution below the two ends."""
        whole, (low, high) = NormalDist(self.mean, self.sd), self.ends
        return whole.cdf(low), whole.cdf(high)

    def quantile(self, share: float) -> float:
        low, high = self.ends
        below, up_to = self._shares
        of_whole = below + (up_to - below) * share
        if not 0 < share < 1:
            return high if share >= 1 else low
        return min(max(NormalDist(self.mean, self.sd).inv_cdf(of_whole), low), high)

    @model_validator(mode="after")
    def _ends_are_near(self) -> Normal:
        below, up_to = self._shares
        if up_to - below < 1e-6:
            low, high = self.ends
            raise invalid(
                f"less than a millionth of the distribution lies between {low:g} and {high:g}; allowed: ends nearer "
                "to it",
                at=("mean",),
            )
        return self


class Choice(Variation):
    """One of several values of any type, uniformly distributed; a severity is an index in the list."""

    values: Annotated[tuple[Any, ...], Field(strict=False, min_length=1, max_length=1000)]
    """List of values, the benign or the mildest one first."""

    def quantile(self, share: float) -> Any:
        return self.values[min(int(share * len(self.values)), len(self.values) - 1)]

    def probes(self) -> dict[tuple[str | int, ...], Any]:
        return {("values", index): value for index, value in enumerate(self.values)}

    def _from(self, benign: Any) -> list[Any]:
        return [benign, *(value for value in self.values if value != benign)]

    def severities(self, benign: Any) -> range:
        return range(len(self._from(benign)))

    def at_severity(self, severity: int, benign: Any) -> Any:
        return self._from(benign)[severity]


VARIATIONS = Family(
    "variation",
    Variation,
    {"uniform": Uniform, "loguniform": LogUniform, "normal": Normal, "integers": Integers, "choice": Choice},
)
