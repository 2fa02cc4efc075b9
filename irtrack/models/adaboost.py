"""AdaBoost on decision stumps.

    F(x) = sum_t alpha_t h_t(x),  h_t = above_t if x_(f_t) > threshold_t, else below_t, each +1 or -1
    alpha_t = 1/2 ln((1 - e_t) / e_t),  w_i <- w_i exp(-alpha_t y_i h_t(x_i)) / Z_t,  Z_t = 2 sqrt(e_t (1 - e_t))

Y. Freund, R. Schapire, J. Computer and System Sciences 55, 1997; R. Schapire, Y. Singer, Machine Learning 37, 1999:
the share of wrong training examples is at most the product of all Z_t (theorem 1). A stump is the one of least weighted
Gini impurity, as in the trees of CART, so that decisions are those of scikit-learn's `AdaBoostClassifier` on trees of
depth 1, or of least error, as in Viola, Jones 2004.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, sqrt
from typing import Literal

import numpy as np
import numpy.typing as npt

from irsim.types import Bools, Floats

Criterion = Literal["gini", "error"]
BLOCK = 16
"""Features whose thresholds are compared at once: few megabytes."""
LEAST_ERROR = 1e-10
"""Least weighted error of a stump, so that a perfect one has a finite weight."""


@dataclass(frozen=True, slots=True, eq=False)
class Stumps:
    """T weighted stumps: `feature`, `threshold`, classes `above` and `below` it (+1 or -1), `alpha`; (T,) each."""

    feature: npt.NDArray[np.int64]
    threshold: Floats
    above: Floats
    below: Floats
    alpha: Floats

    def decisions(self, values: Floats) -> Floats:
        """Return F / sum alpha (n,), -1 .. 1, of the values (n, T) of the stumps' features, in their order."""
        votes = np.where(values > self.threshold, self.alpha * self.above, self.alpha * self.below)
        shares: Floats = votes.sum(axis=1) / max(float(self.alpha.sum()), 1e-300)
        return shares

    @property
    def bound(self) -> float:
        """Bound of the share of wrong training examples: prod 2 sqrt(e (1 - e)) = prod 1 / cosh(alpha)."""
        return float(np.exp(-np.log(np.cosh(self.alpha)).sum()))


def fit_stumps(values: Floats, positive: Bools, rounds: int, criterion: Criterion = "gini") -> Stumps:
    """Return at most `rounds` stumps on features (n, F) of examples whose class is `positive` (n,).

    They end early after a stump without error, and before one that is no better than chance. Classes of a stump's sides
    may be equal, as in a tree of depth 1.
    """
    n = len(values)
    order = np.argsort(values, axis=0, kind="stable").T.astype(np.int32)
    ranked = np.take_along_axis(values.T, order, axis=1)
    distinct = ranked[:, 1:] > ranked[:, :-1]
    y = np.where(positive, 1.0, -1.0)
    w = np.full(n, 1 / n)
    found: list[tuple[int, float, float, float, float]] = []
    for _ in range(rounds):
        feature, place = _best(w, w * positive, order, distinct, criterion)
        threshold = (ranked[feature, place] + ranked[feature, place + 1]) / 2
        high = values[:, feature] > threshold
        above, below = _side(w, y, high), _side(w, y, ~high)
        h = np.where(high, above, below)
        error = float(w @ (h != y))
        if error >= 0.5 - LEAST_ERROR:
            break
        alpha = 0.5 * log((1 - max(error, LEAST_ERROR)) / max(error, LEAST_ERROR))
        found.append((feature, float(threshold), above, below, alpha))
        if error <= LEAST_ERROR:
            break
        w = w * np.exp(-alpha * y * h) / (2 * sqrt(error * (1 - error)))
    columns = list(zip(*found, strict=True)) if found else [()] * 5
    return Stumps(np.array(columns[0], np.int64), *(np.array(each, np.float64) for each in columns[1:]))


def _side(w: Floats, y: Floats, inside: Bools) -> float:
    """Return the class of the larger weight on one side of a threshold."""
    return 1.0 if float((w * y)[inside].sum()) > 0 else -1.0


def _best(
    w: Floats, positives: Floats, order: npt.NDArray[np.int32], distinct: Bools, criterion: Criterion
) -> tuple[int, int]:
    """Return feature and rank of the best threshold, from the weights (n,), 0 for negatives in `positives`.

    order (F, n): ranks of each feature;  distinct (F, n - 1): True where a threshold fits behind a rank
    """
    best = (np.inf, 0, 0)
    whole, whole_p = float(w.sum()), float(positives.sum())
    for first in range(0, len(order), BLOCK):
        rows = order[first : first + BLOCK]
        t = np.cumsum(w.take(rows), axis=1)[:, :-1]
        p = np.cumsum(positives.take(rows), axis=1)[:, :-1]
        above, above_p = whole - t, whole_p - p
        if criterion == "error":
            cost = np.minimum(p + (above - above_p), (t - p) + above_p)
        else:
            cost = p * (t - p) / np.maximum(t, 1e-300) + above_p * (above - above_p) / np.maximum(above, 1e-300)
        cost[~distinct[first : first + BLOCK]] = np.inf
        feature, place = np.unravel_index(int(cost.argmin()), cost.shape)
        best = min(best, (float(cost[feature, place]), first + int(feature), int(place)))
    return best[1], best[2]
