"""Shares of causes in a loss: Shapley values of a cooperative game whose players are the causes of a scene.

v(S) is the probability that the track is lost where the causes S are present and the others removed, over seeds that
all twins share. The Shapley value of a cause is the mean change of v by its arrival, over all orders of arrival
(L. S. Shapley, 1953); the values add up to v(all) - v(none). Counterfactual Shapley values of causes of a failure:
CF-Shapley (A. Sharma et al., 2022). Where all subsets are too many, the share is the mean of the first and the last
arrival: of add-one-in and leave-one-out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from irsim.types import Bools, Floats

Removed = frozenset[str]
"""Names of removed causes."""

FULL = 5
"""Largest number of causes of which all subsets are run: 32 twins."""

LEVEL = 0.05
"""Probability of naming a cause in a loss of which no cause is one, over all causes together."""

PAIRED = 3
"""Number of causes, those of largest shares, of which all pairs are removed beside a design without all subsets."""


def subsets(causes: Sequence[str]) -> list[Removed]:
    """Return the sets of removed causes that a game needs, the empty one first."""
    if len(causes) <= FULL:
        return [frozenset(each) for size in range(len(causes) + 1) for each in combinations(causes, size)]
    every = frozenset(causes)
    return [frozenset(), *(frozenset([each]) for each in causes), *(every - {each} for each in causes), every]


def is_full(causes: Sequence[str]) -> bool:
    """Return whether the game has all subsets, so that its shares are Shapley values."""
    return len(causes) <= FULL


@dataclass(frozen=True)
class Share:
    """Share of a cause in the probability of a loss, from -1 to 1; a negative one holds the track.

    low, high  interval of 1 - `LEVEL` for a one-sided test of all causes together (Bonferroni)
    restored   number of seeds in which its removal alone restores the track, of those lost with nothing removed
    named      True where the interval lies above the placebo's effect
    """

    cause: str
    value: float
    low: float
    high: float
    restored: int
    named: bool


@dataclass(frozen=True)
class Repair:
    """Smallest set of at most two causes whose removal restores the track, and in how many of the lost seeds."""

    causes: tuple[str, ...]
    restored: int


@dataclass(frozen=True, eq=False)
class Game:
    """Outcomes of twins.

    lost      by removed causes: True for each seed in which the track is lost, (seeds,) bool, the same seeds in all
    placebo   the same for other seeds with nothing removed
    """

    causes: tuple[str, ...]
    lost: Mapping[Removed, Bools]
    placebo: Bools

    @property
    def seeds(self) -> int:
        return len(self.placebo)

    def probability(self, removed: Removed = frozenset()) -> float:
        """Return the share of seeds in which the track is lost without the causes `removed`."""
        return float(self.lost[removed].mean())

    @property
    def p_none(self) -> float:
        """Probability of the loss with all causes removed: the unexplained part."""
        return self.probability(frozenset(self.causes))

    @property
    def placebo_effect(self) -> float:
        """Change of the probability of the loss by other seeds alone."""
        return abs(self.probability() - float(self.placebo.mean()))

    @property
    def placebo_restored(self) -> float:
        """Share of all seeds, those of the placebo included, in which the track holds with nothing removed."""
        return 1 - float(np.concatenate([self.lost[frozenset()], self.placebo]).mean())

    @property
    def residual(self) -> float:
        """v(all) - v(none) less the sum of the shares; 0 for Shapley values."""
        return self.probability() - self.p_none - sum(share.value for share in self.shares())

    def shares(self) -> list[Share]:
        """Return the shares of all causes, the largest first.

        The variance of a share is that of its mean over the seeds, s²/n, but at least that by which v(S) of n binary
        outcomes is known at all (Jeffreys' posterior), so that equal outcomes of few seeds have an interval, too.
        """
        from scipy.special import stdtrit  # scipy.stats takes a second to import

        found = []
        for cause in self.causes:
            weights = _weights(self.causes, cause)
            values: Floats = np.sum([weight * self.lost[removed] for removed, weight in weights.items()], axis=0)
            least = sum(weight**2 * _posterior_variance(self.lost[each]) for each, weight in weights.items())
            variance = max(float(values.var(ddof=1)) / self.seeds, least)
            value = float(values.mean())
            reach = float(stdtrit(self.seeds - 1, 1 - LEVEL / len(self.causes))) * math.sqrt(variance)
            low, high = max(value - reach, -1.0), min(value + reach, 1.0)
            alone = int((self.lost[frozenset()] & ~self.lost[frozenset([cause])]).sum())
            found.append(Share(cause, value, low, high, alone, low > self.placebo_effect))
        return sorted(found, key=lambda share: -share.value)

    def repairs(self) -> list[Repair]:
        """Return the minimal repairs of at most two removals, the most frequent first."""
        counts: dict[tuple[str, ...], int] = {}
        small = sorted((each for each in self.lost if 1 <= len(each) <= 2), key=lambda each: (len(each), sorted(each)))
        for seed in np.flatnonzero(self.lost[frozenset()]):
            repairs: list[Removed] = []
            for removed in small:
                if not self.lost[removed][seed] and not any(each < removed for each in repairs):
                    repairs.append(removed)
                    counts[tuple(sorted(removed))] = counts.get(tuple(sorted(removed)), 0) + 1
        return [Repair(*each) for each in sorted(counts.items(), key=lambda each: (-each[1], len(each[0]), each[0]))]

    def pairs_to_try(self) -> list[Removed]:
        """Return the pairs of the causes of largest shares that the game lacks, for `repairs`."""
        first = [share.cause for share in self.shares()[:PAIRED]]
        return [pair for each in combinations(first, 2) if (pair := frozenset(each)) not in self.lost]


def _weights(causes: Sequence[str], cause: str) -> dict[Removed, float]:
    """Return the weights by which a share sums v, by the removed causes."""
    every = frozenset(causes)
    others, count = sorted(every - {cause}), len(causes)
    if is_full(causes):
        sizes = range(count)
        arrivals = [(frozenset(each), size) for size in sizes for each in combinations(others, size)]
        shares = [1 / (count * math.comb(count - 1, size)) for size in sizes]
    else:
        arrivals, shares = [(frozenset(), 0), (frozenset(others), 1)], [0.5, 0.5]
    weights: dict[Removed, float] = {}
    for present, size in arrivals:
        weights[every - present - {cause}] = shares[size]
        weights[every - present] = -shares[size]
    return weights


def _posterior_variance(lost: Bools) -> float:
    """Return the variance of a probability known by binary outcomes (n,): of Beta(k + 1/2, n - k + 1/2)."""
    count, total = float(lost.sum()), len(lost)
    return (count + 0.5) * (total - count + 0.5) / ((total + 1) ** 2 * (total + 2))
