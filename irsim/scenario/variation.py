"""What a value of a scenario may be instead: the ranges under `vary`, drawn from and searched.

A variation is asked in two ways. By a share from 0 to 1, of the draws that lie below (its quantile):
a Monte Carlo draw is a uniform share, a search moves in the cube of them. By a whole severity, where 0
is the benign value and every step goes farther from it: what is shrunk, is shrunk towards 0.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from statistics import NormalDist
from typing import Annotated, Any

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Family, Kind
from irsim.config.quantities import LARGEST, Number, Positive

STEPS = 5
"""Severities from the benign value to an end of a range."""

_BETWEEN = math.pi / 10
"""A share at which hardly any range has a whole number: a key that takes no other is found out by it."""

CUT_SD = 4.0
"""Where a normal ends if no ends are given: its standard deviation is 0.05 % less for it."""


class Variation(Kind):
    """Values that a key of the scenario may have."""

    benign: Any = None
    """The value at severity 0; what the scenario itself has where not given."""
    nuisance: bool = False
    """It differs from scene seed to scene seed, and no search chooses it."""

    @abstractmethod
    def quantile(self, share: float) -> Any:
        """The value below which that share of the draws lies, 0 to 1."""

    @abstractmethod
    def probes(self) -> dict[tuple[str | int, ...], Any]:
        """Values to be tried before any is drawn, its outermost above all, by what to name where one is wrong."""

    @abstractmethod
    def severities(self, benign: Any) -> range:
        """Whole severities, 0 among them; below 0 where the benign value lies inside: towards the low end."""

    @abstractmethod
    def at_severity(self, severity: int, benign: Any) -> Any:
        """The value at one of the `severities`."""

    def misfit(self, benign: Any) -> str | None:
        """Why nothing can begin at that benign value; None where it can."""
        return None


class Span(Variation):
    """Numbers between two ends."""

    @property
    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """The low and the high end."""

    def probes(self) -> dict[tuple[str | int, ...], Any]:
        low, high = self.ends
        return {("kind",): self.quantile(_BETWEEN), ("low",): low, ("high",): high}

    def between(self, start: float, end: float, share: float) -> float:
        """The value at that share of the way from `start` to `end`, as steps of a severity go."""
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
            raise PydanticCustomError(
                "ends",
                "{low} is not below {high}; allowed: low below high",
                {"low": f"{low:g}", "high": f"{high:g}", "at": ("low",)},
            )
        return self


class Uniform(Span):
    """Any number between two ends, each as likely."""

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
    """Any number between two ends, each order of magnitude as likely."""

    low: Positive
    """Least value."""
    high: Positive
    """Greatest value."""

    def between(self, start: float, end: float, share: float) -> float:
        return float(start * (end / start) ** share) if share < 1 else end


class Integers(Span):
    """A whole number between two ends, each as likely."""

    low: Annotated[int, Field(ge=-LARGEST, le=LARGEST)]
    """Least value."""
    high: Annotated[int, Field(ge=-LARGEST, le=LARGEST)]
    """Greatest value, which can be drawn too."""

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high

    def quantile(self, share: float) -> int:
        return min(self.low + math.floor(share * (self.high - self.low + 1)), self.high)

    def between(self, start: float, end: float, share: float) -> int:
        return round(super().between(start, end, share))


class Normal(Span):
    """Normally distributed numbers, none beyond its ends."""

    mean: Number
    """Mean, before it is cut."""
    sd: Positive
    """Standard deviation, before it is cut."""
    low: Number | None = None
    """Least value; 4 standard deviations below the mean where not given."""
    high: Number | None = None
    """Greatest value; 4 standard deviations above the mean where not given."""

    @property
    def ends(self) -> tuple[float, float]:
        low = self.mean - CUT_SD * self.sd if self.low is None else self.low
        return low, self.mean + CUT_SD * self.sd if self.high is None else self.high

    @property
    def _shares(self) -> tuple[float, float]:
        """Shares of the uncut distribution below its two ends."""
        uncut, (low, high) = NormalDist(self.mean, self.sd), self.ends
        return uncut.cdf(low), uncut.cdf(high)

    def quantile(self, share: float) -> float:
        low, high = self.ends
        below, up_to = self._shares
        uncut = below + (up_to - below) * share
        if not 0 < share < 1:
            return high if share >= 1 else low
        return min(max(NormalDist(self.mean, self.sd).inv_cdf(uncut), low), high)

    @model_validator(mode="after")
    def _something_is_left(self) -> Normal:
        below, up_to = self._shares
        if up_to - below < 1e-6:
            raise PydanticCustomError(
                "far_ends",
                "less than a millionth of the distribution lies between {low} and {high}; allowed: ends nearer to it",
                {"low": f"{self.ends[0]:g}", "high": f"{self.ends[1]:g}", "at": ("mean",)},
            )
        return self


class Choice(Variation):
    """One of several values of any kind, each as likely; a severity is a place in the list."""

    values: Annotated[tuple[Any, ...], Field(strict=False, min_length=1, max_length=1000)]
    """What there is to choose from, the benign one or the mildest first."""

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
