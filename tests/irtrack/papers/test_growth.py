"""The growth model and its filters, against another program and steps by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from irtrack.filters.resampling import after_selection, largest_first
from irtrack.papers import growth
from irtrack.papers.growth import BOOTSTRAP, WSPF, Growth, rmse, run

ORACLE = 4.99
"""Mean RMSE of the bootstrap filter, N = 100, over 4,000 runs of 100 steps, +-.03, by another program."""
WSPF_TRIAL = 5.55
"""The same of weight selection with resampling at every step and equal weights."""


def mean_rmse(filter: growth.GrowthFilter, runs: int, seed: int) -> tuple[float, float]:
    """Mean over runs and its standard error."""
    model = Growth.of(runs, seed)
    errors = rmse(model, run(model, filter, seed))
    return float(errors.mean()), float(errors.std(ddof=1) / np.sqrt(runs))


def test_filters_agree_with_another_program() -> None:
    mean, error = mean_rmse(BOOTSTRAP, 400, 7)
    assert mean == pytest.approx(ORACLE, abs=3 * error + 0.03)
    assert error < 0.1  # or the two filters could be exchanged
    mean, error = mean_rmse(replace(WSPF, restoring="equal", threshold=1.0), 400, 8)
    assert mean == pytest.approx(WSPF_TRIAL, abs=3 * error + 0.04)


def test_model_by_hand() -> None:
    """k = 1, x = 2: 1 + 50/5 + 8 cos 1.2 = 11 + 2.898862."""
    assert growth.transition(np.array([2.0]), 1) == pytest.approx([13.898862], abs=1e-6)
    model = Growth.of(3000, 3, steps=2)
    # y - x^2 / 20 is unit noise: variance 1 +- 5 standard errors of sqrt(2 / 6000).
    assert np.var(model.measurements - model.states**2 / 20) == pytest.approx(1, abs=0.1)


def test_weights_of_a_row_do_not_vanish() -> None:
    """The only particle with a weight keeps it, however far it is from the measurement."""
    weights = growth.reweight(np.array([[0.0, 1.0, 0.0]]), np.array([[20.0]]), np.array([[20.0, -1e4, 1.0]]))
    assert weights.tolist() == [[0, 1, 0]]
    # x = 0, sqrt 20 stand for y = 0, 1: at y = 0 the likelihoods are as 1 to exp(-1/2).
    weights = growth.reweight(np.full((1, 2), 0.5), np.array([[0.0]]), np.array([[0.0, np.sqrt(20)]]))
    assert weights[0, 1] / weights[0, 0] == pytest.approx(np.exp(-0.5))


def test_weight_selection_by_hand() -> None:
    """N = 5, Np = 3, weights .1 .3 .05 .4 .15: kept .3 .4 .15 of .85; set aside .1 and .05."""
    weights = np.array([0.1, 0.3, 0.05, 0.4, 0.15])
    order = largest_first(weights, 3)
    assert set(order[:3]) == {1, 3, 4}
    assert sorted(order) == [0, 1, 2, 3, 4]
    ordered = weights[order]
    assert sorted(ordered[:3] / ordered[:3].sum()) == pytest.approx([0.15 / 0.85, 0.3 / 0.85, 0.4 / 0.85])
    own = after_selection(ordered, 3, "own")
    assert own[:3] == pytest.approx([0.85 / 3] * 3)
    assert sorted(own[3:]) == pytest.approx([0.05, 0.1])
    assert after_selection(ordered, 3, "equal") == pytest.approx([0.2] * 5)


def test_same_seed_gives_same_runs() -> None:
    first, second = (run(Growth.of(20, 5), WSPF, 5) for _ in range(2))
    assert np.array_equal(first.estimates, second.estimates)
    assert np.isfinite(first.estimates).all()
    assert (first.neff >= 1 - 1e-9).all()
    assert (first.neff <= 100 + 1e-9).all()
