"""Where a tracker breaks: the severity at which half of the runs are lost, with its interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irsim.types import Floats
from irtrack.metrics.interval import wilson

HALF = 0.5
"""The share of lost runs that a breaking point is the severity of."""


@dataclass(frozen=True, slots=True, eq=False)
class Breaking:
    """The share of lost runs against severity, and where it reaches one half.

    severities        (n,) rising, those that were run
    runs, lost        (n,) how many runs, and how many of them were lost
    shares            (n,) lost/runs;  low, high  (n,) their Wilson 95 % intervals
    at                severity of 50 % loss; inf where even the highest severity stays below that, -inf where
                      the lowest has more already
    at_low, at_high   its 95 % interval; -inf, inf where the severities that were run do not bound it
    """

    severities: Floats
    runs: np.ndarray
    lost: np.ndarray
    shares: Floats
    low: Floats
    high: Floats
    at: float
    at_low: float
    at_high: float

    def in_words(self) -> str:
        """'3.4 (3 to 4)'; '> 5' where it surely holds the last severity; '< 0' where it is surely lost at the first."""
        first, last = f"{self.severities[0]:g}", f"{self.severities[-1]:g}"
        low = f"{self.at_low:g}" if math.isfinite(self.at_low) else f"< {first}"
        high = f"{self.at_high:g}" if math.isfinite(self.at_high) else f"> {last}"
        if math.isfinite(self.at):
            return f"{self.at:.2g} ({low} to {high})"
        where, told = (high, low == last) if self.at > 0 else (low, high == first)
        return where if told else f"{where} ({low} to {high})"


def breaking_point(severities: Sequence[float] | Floats, lost: Sequence[bool] | np.ndarray) -> Breaking | None:
    """The breaking point of a tracker from runs at several severities; None where there is no run.

    severities (n,) of each run; lost (n,) bool: was it lost (or did it fail)?

    A higher severity is taken to lose no fewer runs. The point is where the isotonic (least squares, rising)
    curve through the shares, joined by lines, reaches one half (Barlow et al., Statistical Inference under
    Order Restrictions, 1972). Its interval asks nothing of the curve between severities: it begins at the last
    of the lowest severities that all lose surely less than half, and ends at the first of the highest that all
    lose surely more, each by its Wilson interval. Tested in this order, no test needs to be stricter for there
    being several (Hsu and Berger, J. Am. Stat. Assoc. 94 (1999) 468).
    """
    levels, which = np.unique(np.asarray(severities, dtype=np.float64), return_inverse=True)
    if len(levels) == 0:
        return None
    runs = np.bincount(which)
    count = np.bincount(which, weights=np.asarray(lost, dtype=np.float64)).astype(np.int64)
    shares = count / runs
    low, high = np.array([wilson(int(hits), int(total)) for hits, total in zip(count, runs, strict=True)]).T
    surely_less, surely_more = high < HALF, low > HALF
    held = int(np.argmin(surely_less)) if not surely_less.all() else len(levels)
    broken = int(np.argmin(surely_more[::-1])) if not surely_more.all() else len(levels)
    return Breaking(
        levels,
        runs,
        count,
        shares,
        low,
        high,
        at=_crossing(levels, shares, runs),
        at_low=float(levels[held - 1]) if held else -math.inf,
        at_high=float(levels[-broken]) if broken else math.inf,
    )


def _crossing(levels: Floats, shares: Floats, runs: np.ndarray) -> float:
    """Where the isotonic curve of the shares reaches one half."""
    from scipy.optimize import isotonic_regression

    curve = isotonic_regression(shares, weights=runs).x
    reached = int(np.searchsorted(curve, HALF))
    if reached == len(curve):
        return math.inf
    if reached == 0:
        return float(levels[0]) if curve[0] == HALF else -math.inf
    return float(np.interp(HALF, curve[reached - 1 : reached + 1], levels[reached - 1 : reached + 1]))
