"""How well a cue tells a target from its surroundings: measures of two histograms q and b, (bins,) each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from irsim.types import Floats
from irtrack.features.histogram import bhattacharyya

Confidence = Literal["bhattacharyya", "kullback_leibler", "variance_ratio"]

FLOOR = 1e-3
"""Least share of a bin in a logarithm: delta of Collins et al. 2005, section 2.2."""


def distance(q: Floats, b: Floats) -> float:
    """sqrt(1 - rho(q, b)), 0 .. 1 (Comaniciu et al. 2003, eq. 6)."""
    return float(np.sqrt(1 - bhattacharyya(q, b)))


def kullback_leibler(q: Floats, b: Floats) -> float:
    """sum q ln(q / b), with no share under `FLOOR`; 0 or more but for that floor, and at least 0."""
    return max(float(q @ _log_ratio(q, b)), 0.0)


def variance_ratio(q: Floats, b: Floats) -> float:
    """var(L; (q + b) / 2) / (var(L; q) + var(L; b)), L = ln(q / b).

    R. Collins, Y. Liu, M. Leordeanu, "Online Selection of Discriminative Tracking Features", IEEE
    TPAMI 27(10), 2005, eq. 2 to 4. 0 where q and b are alike.
    """
    ratio = _log_ratio(q, b)

    def variance(p: Floats) -> float:
        return max(float(p @ ratio**2) - float(p @ ratio) ** 2, 0.0)

    between, within = variance((q + b) / 2), variance(q) + variance(b)
    return between / max(within, FLOOR) if between > 0 else 0.0


def _log_ratio(q: Floats, b: Floats) -> Floats:
    ratio: Floats = np.log(np.maximum(q, FLOOR) / np.maximum(b, FLOOR))
    return ratio


CONFIDENCES: dict[Confidence, Callable[[Floats, Floats], float]] = {
    "bhattacharyya": distance,
    "kullback_leibler": kullback_leibler,
    "variance_ratio": variance_ratio,
}
