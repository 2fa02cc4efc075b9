"""Coverage of the intervals of metrics: each contains the true value as often as it says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multinomial

from irsim.rng import stream
from irtrack.metrics import Difference, breaking_point, paired_difference, wilson


def test_the_breaking_point_lies_in_its_interval() -> None:
    """A logistic loss whose half lies at 2.3: of 400 experiments of 30 runs a severity, 95 % or more hold it."""
    severities = np.repeat(np.arange(6.0), 30)
    chance = 1 / (1 + np.exp(-1.5 * (severities - 2.3)))
    held = 0
    for k in range(400):
        found = breaking_point(severities, stream(1, "breaking", k).random(len(chance)) < chance)
        assert found is not None
        held += found.at_low <= 2.3 <= found.at_high
    assert wilson(held, 400)[1] >= 0.95


@pytest.mark.parametrize(("scenes", "runs"), [(6, 6), (12, 3), (1, 20)])
def test_the_paired_difference_lies_in_its_interval(scenes: int, runs: int) -> None:
    """Runs of one scene share its effect; 300 experiments: 95 % within four standard errors (1.26 % each), at least."""
    rng = np.random.default_rng(11)
    names = [f"s{scene}" for scene in range(scenes) for _ in range(runs)]
    inside = 0
    for _ in range(300):
        effect = np.repeat(rng.normal(size=scenes) if scenes > 1 else [0.0], runs)
        found = paired_difference(0.3 + effect + rng.normal(size=len(names)), np.zeros(len(names)), names, draws=400)
        assert found is not None
        inside += found.low <= 0.3 <= found.high
    assert 0.90 <= inside / 300 <= 0.99


def losses(more: int, fewer: int, scenes: int) -> Difference:
    """Of so many scenes, those that the first alone loses, and those that the second alone does."""
    first, second = [1.0] * more + [0.0] * (scenes - more), [0.0] * more + [1.0] * fewer
    second += [0.0] * (scenes - len(second))
    found = paired_difference(first, second, [str(k) for k in range(scenes)], most=1.0)
    assert found is not None
    return found


@pytest.mark.parametrize("scenes", [6, 10, 20, 60])
def test_the_difference_of_losses_lies_in_its_interval(scenes: int) -> None:
    """Exactly: every outcome with its probability, for chances from none to surely of either."""
    outcomes = [(more, fewer) for more in range(scenes + 1) for fewer in range(scenes + 1 - more)]
    found = [losses(*outcome, scenes) for outcome in outcomes]
    low, high = np.array([(each.low, each.high) for each in found]).T
    chances = [0.0, 0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95, 1.0]
    missed = []
    for p, q in [(p, q) for p in chances for q in chances if p + q <= 1]:
        weights = multinomial.pmf([(u, d, scenes - u - d) for u, d in outcomes], scenes, [p, q, max(1 - p - q, 0.0)])
        assert weights.sum() == pytest.approx(1)
        missed.append(weights[(low > p - q + 1e-12) | (high < p - q - 1e-12)].sum())
    assert max(missed) < 0.06
