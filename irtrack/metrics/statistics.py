"""Shares and means, and their intervals."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from irsim.rng import stream
from irsim.types import Floats


def share(hits: np.ndarray) -> float:
    """Share 0..1 of truth values (n,) that are true; nan of nothing."""
    return np.count_nonzero(hits) / len(hits) if len(hits) else np.nan


def wilson(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """The interval of a share `count`/`total`; (0, 1) of nothing.

    Wilson, J. Am. Stat. Assoc. 22 (1927) 209: the score interval, without continuity correction.
    """
    if total == 0:
        return 0.0, 1.0
    z = NormalDist().inv_cdf((1 + level) / 2)
    share = count / total
    middle = share + z * z / (2 * total)
    reach = z * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total))
    scale = 1 + z * z / total
    low = 0.0 if count == 0 else (middle - reach) / scale
    high = 1.0 if count == total else (middle + reach) / scale
    return low, high


def mean_interval(values: Floats, level: float = 0.95) -> tuple[Floats, Floats, Floats]:
    """(mean, low, high) over the first axis of values (n, ...), n >= 1: Student's t, n - 1 degrees of freedom.

    The ends of a single value are infinite: it says nothing of its spread. For shares there is `wilson`.
    """
    mean = np.mean(values, axis=0)
    count = len(values)
    if count == 1:
        return mean, np.full_like(mean, -np.inf), np.full_like(mean, np.inf)
    from scipy.special import stdtrit  # scipy.stats takes a second to import

    reach = stdtrit(count - 1, (1 + level) / 2) * np.std(values, axis=0, ddof=1) / math.sqrt(count)
    return mean, mean - reach, mean + reach


@dataclass(frozen=True, slots=True, eq=False)
class Survival:
    """A step function: from times[i] on, the share held[i], with its interval low[i] .. high[i].

    Before times[0] all are held. at_risk[i] is the number of tracks watched just before times[i].
    """

    times: Floats
    held: Floats
    low: Floats
    high: Floats
    at_risk: np.ndarray

    @property
    def median(self) -> float | None:
        """The time by which half are lost; None where so many never are."""
        reached = np.flatnonzero(self.held <= 0.5)
        return float(self.times[reached[0]]) if len(reached) else None


def kaplan_meier(times: Sequence[float] | Floats, lost: Sequence[bool] | np.ndarray, level: float = 0.95) -> Survival:
    """The share of tracks still held against time.

    Kaplan and Meier, J. Am. Stat. Assoc. 53 (1958) 457; variance by Greenwood (1926), the interval on
    the scale log(-log S) (Kalbfleisch and Prentice 1980), which stays within 0..1.

    times   (n,) when each track was lost, or ended; any unit
    lost    (n,) bool: was it lost then? Else it was held to its end (censored)
    """
    times, lost = np.asarray(times, dtype=np.float64), np.asarray(lost, dtype=bool)
    moments = np.unique(times[lost])
    at_risk = np.array([(times >= moment).sum() for moment in moments], dtype=np.int64)
    losses = np.array([(lost & (times == moment)).sum() for moment in moments], dtype=np.int64)
    held = np.cumprod(1 - losses / at_risk)
    left = at_risk - losses
    with np.errstate(divide="ignore", invalid="ignore"):
        greenwood = np.cumsum(losses / (at_risk * left))
        reach = NormalDist().inv_cdf((1 + level) / 2) * np.sqrt(greenwood) / np.abs(np.log(held))
        low, high = held ** np.exp(reach), held ** np.exp(-reach)
    none_left = held == 0  # no variance is known there
    low[none_left], high[none_left] = 0.0, 0.0
    return Survival(moments, held, low, high, at_risk)


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


DRAWS = 2000
"""Bootstrap samples: the ends of a 95 % interval are then within half a percent of its probability."""

LEAST_SCENES = 6
"""With fewer, even differences of one sign happen by chance in more than 5 % of cases (sign test: 2 / 2^n)."""

MOST_SCENES = 2**62
"""No one is told to run more."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Mean of a - b over pairs, and its interval low .. high; `scenes` clusters of `pairs` pairs in all.

    spread  standard deviation of the scenes seen
    unseen  the interval takes in two scenes more, with this difference and with its negative; 0: none
    """

    mean: float
    low: float
    high: float
    pairs: int
    scenes: int
    spread: float = 0.0
    unseen: float = 0.0

    @property
    def is_tie(self) -> bool:
        """Does the interval hold zero?"""
        return self.low <= 0 <= self.high

    @property
    def is_open(self) -> bool:
        """Are there fewer than `LEAST_SCENES`, so that nothing can be told?"""
        return self.low == -np.inf


def paired_difference(
    a: Sequence[float] | Floats,
    b: Sequence[float] | Floats,
    scenes: Sequence[str],
    level: float = 0.95,
    draws: int = DRAWS,
    most: float = np.inf,
) -> Difference | None:
    """The mean of a - b and its bootstrap interval; None where there is no pair.

    a, b     (n,) figures of two trackers, pair by pair on the same frames; pairs with a nan are left out
    scenes   (n,) which scene each pair is of
    most     no two figures can differ by more: 1 for shares and losses

    Runs of one scene are alike, so whole scenes are drawn with replacement, not runs (cluster
    bootstrap: Davison and Hinkley, Bootstrap Methods, 1997, section 3.8); the ends are percentiles, with
    Student's t in place of the normal, as few scenes make percentiles too narrow (Hesterberg, Am. Stat.
    69 (2015) 371, section 4.1). One scene alone is no sample of scenes: then its runs are drawn. Fewer than
    LEAST_SCENES of either say nothing: the interval has no ends. The same input gives the same interval.

    Figures that are all 0 or `most`, as losses are, have too few values for percentiles: where all scenes differ by
    the same, a bootstrap has no width, as if the next scene could not differ. Two scenes more are taken in, one with
    the difference `most` and one with -`most`, before the mean's interval by Student's t (Bonett and Price, J. Educ.
    Behav. Stat. 37 (2012) 479, one more of either disagreement, there with the normal). Of 6 to 60 scenes with any
    chances of loss it misses in at most 5.6 % of cases, where the bootstrap misses in up to 97 %.
    """
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    known = np.isfinite(first - second)
    first, second, names = first[known], second[known], np.asarray(scenes)[known]
    differences = first - second
    if len(differences) == 0:
        return None
    _, cluster = np.unique(names, return_inverse=True)
    scene_count = int(cluster.max()) + 1
    if scene_count == 1:
        cluster = np.arange(len(differences))
    sums, counts = np.bincount(cluster, differences), np.bincount(cluster)
    mean = float(differences.mean())
    if len(sums) < LEAST_SCENES:
        return Difference(mean, -np.inf, np.inf, len(differences), scene_count)
    # Of scenes with unlike numbers of runs: what each adds to the mean over all runs, to first order.
    added = mean + (sums - mean * counts) / counts.mean()
    spread = float(added.std())
    if np.isfinite(most) and np.isin([first, second], (0.0, most)).all():
        low, high = _with_unseen(added, most, level)
        return Difference(mean, low, high, len(differences), scene_count, spread, most)
    drawn = stream(0, "bootstrap", 0).integers(0, len(sums), (draws, len(sums)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, _tails(len(sums), level))
    return Difference(mean, float(low), float(high), len(differences), scene_count, spread)


def scenes_for(found: Difference, half_width: float, level: float = 0.95) -> int:
    """How many scenes narrow an interval of `paired_difference` to mean +- half_width (> 0), in its units, if more
    scenes differ as those seen do. A difference that is open tells nothing of it.
    """
    return bisect_left(
        range(MOST_SCENES),
        True,
        lo=LEAST_SCENES,
        key=lambda scenes: _half_width(found, scenes, level) <= half_width,
    )


def _half_width(found: Difference, scenes: int, level: float) -> float:
    """Of the interval of n scenes: t s / sqrt(n), where n spread^2 / (n - 1) = s^2.

    With scenes +-u taken in t s / sqrt(n + 2), where n spread^2 + 2 u^2, and as the mean is nearer to zero
    mean^2 2 n / (n + 2) more, are (n + 1) s^2.
    """
    from scipy.special import stdtrit  # scipy.stats takes a second to import

    unseen = 2 if found.unseen else 0
    count = scenes + unseen
    squares = scenes * found.spread**2 + unseen * (found.unseen**2 + found.mean**2 * scenes / count)
    return float(stdtrit(count - 1, (1 + level) / 2) * np.sqrt(squares / (count - 1) / count))


def _with_unseen(differences: Floats, most: float, level: float) -> tuple[float, float]:
    """The interval of the mean of differences (n,) within -most .. most, two unseen ones taken in."""
    _, low, high = mean_interval(np.append(differences, [most, -most]), level)
    return max(float(low), -most), min(float(high), most)


def _tails(clusters: int, level: float) -> tuple[float, float]:
    """The percentiles to take, widened as t is wider than the normal and the sample's sd too small."""
    from scipy.special import ndtr, stdtrit  # scipy.stats takes a second to import

    wide = np.sqrt(clusters / (clusters - 1)) * stdtrit(clusters - 1, (1 + level) / 2)
    tail = float(ndtr(-wide))
    return tail, 1 - tail
