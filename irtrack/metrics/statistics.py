"""Shares, means and differences with their intervals: Wilson, Student, isotonic, cluster bootstrap."""

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
    """Return the share 0..1 of values (n,) bool that are true; nan without values."""
    return np.count_nonzero(hits) / len(hits) if len(hits) else np.nan


def wilson(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Return the confidence interval of a share `count`/`total`; (0, 1) where `total` is 0.

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
    """Return mean and Student's t interval (mean, low, high) over the first axis of values (n, ...), n >= 1.

    The ends of a single value are infinite: its standard deviation is unknown. For shares see `wilson`.
    """
    mean = np.mean(values, axis=0)
    count = len(values)
    if count == 1:
        return mean, np.full_like(mean, -np.inf), np.full_like(mean, np.inf)
    from scipy.special import stdtrit  # scipy.stats takes a second to import

    reach = stdtrit(count - 1, (1 + level) / 2) * np.std(values, axis=0, ddof=1) / math.sqrt(count)
    return mean, mean - reach, mean + reach


HALF = 0.5
"""Share of lost runs at the breaking point."""


@dataclass(frozen=True, slots=True, eq=False)
class Breaking:
    """Share of lost runs against severity, and the severity where it reaches one half.

    severities        (n,) severities that were run, rising
    runs, lost        (n,) numbers of runs, and of lost runs
    shares            (n,) lost/runs;  low, high  (n,) their Wilson 95 % intervals
    at                severity of 50 % lost runs; inf where the share stays below 50 % at the highest severity, -inf
                      where it is above 50 % at the lowest
    at_low, at_high   95 % interval of `at`; -inf, inf where the severities do not bound it
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
        """Return '3.4 (3 to 4)'; '> 5' where the interval lies above the last severity; '< 0' where it lies below the
        first."""
        first, last = f"{self.severities[0]:g}", f"{self.severities[-1]:g}"
        low = f"{self.at_low:g}" if math.isfinite(self.at_low) else f"< {first}"
        high = f"{self.at_high:g}" if math.isfinite(self.at_high) else f"> {last}"
        if math.isfinite(self.at):
            return f"{self.at:.2g} ({low} to {high})"
        where, bounded = (high, low == last) if self.at > 0 else (low, high == first)
        return where if bounded else f"{where} ({low} to {high})"


def breaking_point(severities: Sequence[float] | Floats, lost: Sequence[bool] | np.ndarray) -> Breaking | None:
    """Return the breaking point of a tracker from runs at several severities; None where there is no run.

    `severities` (n,): severity of each run; `lost` (n,) bool: True where the run was lost or failed

    A higher severity is assumed to lose no fewer runs. The point is where the isotonic (least squares, rising) curve
    through the shares, joined by lines, reaches one half (Barlow et al., Statistical Inference under Order
    Restrictions, 1972). Its interval does not depend on the curve between severities: it begins at the highest severity
    up to which all Wilson intervals lie below one half, and ends at the lowest severity beyond which all lie above.
    Tests in this order need no correction for their number (Hsu and Berger, J. Am. Stat. Assoc. 94 (1999) 468).
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
    """Return the severity where the isotonic curve of the shares reaches one half."""
    from scipy.optimize import isotonic_regression

    curve = isotonic_regression(shares, weights=runs).x
    reached = int(np.searchsorted(curve, HALF))
    if reached == len(curve):
        return math.inf
    if reached == 0:
        return float(levels[0]) if curve[0] == HALF else -math.inf
    return float(np.interp(HALF, curve[reached - 1 : reached + 1], levels[reached - 1 : reached + 1]))


DRAWS = 2000
"""Number of bootstrap samples: the coverage of a 95 % interval is then within half a percent."""

LEAST_SCENES = 6
"""Least number of scenes n: with fewer, all differences have the same sign by chance in over 5 % (sign test: 2 /
2^n)."""

MOST_SCENES = 2**62
"""Largest number of scenes that is suggested to resolve a difference."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Mean of a - b over `pairs` paired runs in `scenes` scenes (clusters), and its interval low .. high.

    spread  standard deviation of the difference over the scenes
    unseen  difference of the two scenes, one positive, one negative, that are added for the interval; 0: none are added
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
        """True where the interval contains zero."""
        return self.low <= 0 <= self.high

    @property
    def is_open(self) -> bool:
        """True where there are fewer than `LEAST_SCENES` scenes, too few for an interval."""
        return self.low == -np.inf


def paired_difference(
    a: Sequence[float] | Floats,
    b: Sequence[float] | Floats,
    scenes: Sequence[str],
    level: float = 0.95,
    draws: int = DRAWS,
    most: float = np.inf,
) -> Difference | None:
    """Return the mean of a - b and its bootstrap interval; None where there is no pair.

    a, b     (n,) values of a metric of two trackers, pair by pair on the same frames; pairs with a nan are left out
    scenes   (n,) scene of each pair
    most     largest possible difference: 1 for shares and losses

    Runs of one scene are correlated, so whole scenes are drawn with replacement, not runs (cluster bootstrap: Davison
    and Hinkley, Bootstrap Methods, 1997, section 3.8). The ends are percentiles, widened from the normal to Student's
    t, as percentiles are too narrow for few scenes (Hesterberg, Am. Stat. 69 (2015) 371, section 4.1). With a single
    scene, its runs are drawn instead. With fewer than `LEAST_SCENES` scenes (or runs) the interval has no ends. The
    same input gives the same interval.

    Metrics with the values 0 and `most` only, such as losses, have too few values for percentiles: where the
    differences of all scenes are equal, the bootstrap has no width. Their interval is that of the mean by Student's t,
    after two scenes are added with the differences `most` and -`most` (Bonett and Price, J. Educ. Behav. Stat. 37
    (2012) 479, with the normal distribution). For 6 to 60 scenes and any probability of loss, at most 5.6 % of these
    intervals miss the mean; of bootstrap intervals, up to 97 %.
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
    # Influence of each scene on the mean over all runs, to first order, as scenes differ in their number of runs.
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
    """Return the number of scenes for an interval of mean +- half_width (> 0), in units of the metric.

    Further scenes are assumed to vary like those run; the difference must have an interval (`is_open` false).
    """
    return bisect_left(
        range(MOST_SCENES),
        True,
        lo=LEAST_SCENES,
        key=lambda scenes: _half_width(found, scenes, level) <= half_width,
    )


def _half_width(found: Difference, scenes: int, level: float) -> float:
    """Return the half width of the interval for n scenes: t s / sqrt(n), where s^2 = n spread^2 / (n - 1).

    With two added scenes +-u it is t s / sqrt(n + 2), where (n + 1) s^2 = n spread^2 + 2 u^2 + mean^2 2 n / (n + 2);
    the last term comes from the shift of the mean towards zero.
    """
    from scipy.special import stdtrit  # scipy.stats takes a second to import

    unseen = 2 if found.unseen else 0
    count = scenes + unseen
    squares = scenes * found.spread**2 + unseen * (found.unseen**2 + found.mean**2 * scenes / count)
    return float(stdtrit(count - 1, (1 + level) / 2) * np.sqrt(squares / (count - 1) / count))


def _with_unseen(differences: Floats, most: float, level: float) -> tuple[float, float]:
    """Return the interval of the mean of differences (n,) within -most .. most, with two scenes added."""
    _, low, high = mean_interval(np.append(differences, [most, -most]), level)
    return max(float(low), -most), min(float(high), most)


def _tails(clusters: int, level: float) -> tuple[float, float]:
    """Return the percentiles of the interval, widened for Student's t and for the bias of the sample's sd."""
    from scipy.special import ndtr, stdtrit  # scipy.stats takes a second to import

    wide = np.sqrt(clusters / (clusters - 1)) * stdtrit(clusters - 1, (1 + level) / 2)
    tail = float(ndtr(-wide))
    return tail, 1 - tail
