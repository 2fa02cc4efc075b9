"""Shares and means, and their intervals."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

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
