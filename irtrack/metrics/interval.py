"""Shares, and their intervals."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np


def share(hits: np.ndarray) -> float:
    """Share 0..1 of truth values (n,) that are true; nan of nothing."""
    return float(np.mean(hits)) if len(hits) else np.nan


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
