"""Weights of particles by Bayes' rule, the SMC step, and the number of particles, against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from math import exp, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, norm
from tracker_loops import plain

from irsim.types import Floats
from irtrack.filters.particle import (
    Likelihood,
    Weights,
    covariance,
    ess,
    ess_count,
    kld_bound,
    kld_count,
    mean,
    smc_step,
)


def test_weights_by_hand() -> None:
    """Priors .25, .5, .25; likelihoods as 1 to e^-1 to e^-2: the logarithms are half the scores."""
    weights = Weights(np.array([6.0, 4.0, 2.0]), np.array([0.25, 0.5, 0.25]), 0.5)
    total = 0.25 + 0.5 * exp(-1) + 0.25 * exp(-2)
    assert pytest.approx(np.array([0.25, 0.5 * exp(-1), 0.25 * exp(-2)]) / total) == weights.W
    assert not weights.degenerate
    assert pytest.approx(1 / (weights.W**2).sum()) == weights.ESS
    assert Weights(np.array([5.0, 5.0])).W.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("scale", [2e4, 1e9])
@pytest.mark.parametrize("loops", [nullcontext, plain])
def test_particles_of_weight_0_keep_it(scale: float, loops: Callable[[], AbstractContextManager[None]]) -> None:
    """The best score is that of a particle of weight 0; the others' likelihoods beside it underflow."""
    with loops():
        weights = Weights(np.array([0.95, 0.4, 0.2]), np.array([0.0, 0.5, 0.5]), scale)
    assert weights.W.tolist() == [0, 1, 0]


def test_many_sets_are_each_as_alone() -> None:
    rng = np.random.default_rng(4)
    prior, score = rng.dirichlet(np.ones(7), (2, 3)), rng.normal(0, 50, (2, 3, 7))
    prior[0, 1, :6] = 0
    weights = Weights(score, prior)
    for at in np.ndindex(2, 3):
        alone = Weights(score[at], prior[at])
        assert weights.W[at] == pytest.approx(alone.W, rel=1e-14)
        assert weights.ESS[at] == pytest.approx(alone.ESS, rel=1e-14)


@pytest.mark.parametrize("loops", [nullcontext, plain])
def test_all_likelihoods_0_give_equal_weights(loops: Callable[[], AbstractContextManager[None]]) -> None:
    nothing, impossible = np.zeros(3), np.full(3, -np.inf)
    with loops():
        for lw, prior in (
            (np.ones(3), nothing),
            (impossible, np.ones(3)),
            (np.array([-np.inf, 1, 2]), np.array([1.0, 0, 0])),
        ):
            weights = Weights(lw, prior)
            assert weights.degenerate
            assert weights.W.tolist() == [1 / 3] * 3
        assert Weights(np.zeros((2, 3)), np.stack([np.full(3, 1 / 3), nothing])).degenerate


@pytest.mark.parametrize("resampled", [True, False])
def test_an_smc_step_by_hand(resampled: bool) -> None:
    """Weights .25, .75; likelihoods 1, e^-2; with resampling both ancestors are the second."""
    step = smc_step(
        np.array([0.25, 0.75]),
        (lambda W: np.full(2, W.argmax())) if resampled else None,
        lambda ancestors: np.array([[0.0, 0], [1, 0]]) + (0 if ancestors is None else ancestors[:, None]),
        lambda x: Likelihood(-x[:, 0], 2.0, np.array([1.0, 0.5])),
    )
    prior = np.array([0.5, 0.5]) if resampled else np.array([0.25, 0.75])
    assert step.particles[:, 0].tolist() == ([1, 2] if resampled else [0, 1])
    assert pytest.approx(prior * [1, exp(-2)] / (prior @ [1, exp(-2)])) == step.W
    assert step.in_view


def test_an_smc_step_outside_the_frame_has_equal_weights() -> None:
    step = smc_step(
        np.array([0.25, 0.75]), None, lambda _: np.zeros((2, 2)), lambda x: Likelihood(x[:, 0], 1.0, np.zeros(2))
    )
    assert (step.W.tolist(), step.in_view) == ([0.5, 0.5], False)


@st.composite
def evidence(draw: st.DrawFn) -> tuple[Floats, Floats]:
    """Priors, some of them 0, and scores far apart."""
    count = draw(st.integers(1, 40))
    prior = draw(st.lists(st.just(0.0) | st.floats(1e-12, 1), min_size=count, max_size=count))
    score = draw(st.lists(st.floats(-1e4, 1e4), min_size=count, max_size=count))
    return np.array(prior), np.array(score)


@settings(max_examples=50)
@given(evidence(), st.floats(0, 100), st.floats(-1e4, 1e4))
def test_invariants_of_weights(given: tuple[Floats, Floats], scale: float, constant: float) -> None:
    """They sum to one; a prior of 0 gives weight 0; a constant added to all scores changes nothing."""
    prior, score = given
    assume(prior.any())
    weights, moved = Weights(score, prior, scale).W, Weights(score + constant, prior, scale).W
    with plain():
        assert weights.tolist() == Weights(score, prior, scale).W.tolist()
    assert weights.sum() == pytest.approx(1, rel=1e-12)
    assert (weights[prior == 0] == 0).all()
    assert weights.min() >= 0
    # Sums of up to 2e4 round by 2e-12 at most, and so does the difference of two.
    assert moved == pytest.approx(weights, rel=1e-11 * max(scale, 1), abs=1e-300)


def test_ess_mean_and_covariance_by_hand() -> None:
    weights = np.array([0.5, 0.25, 0.25])
    places = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 8.0]])
    center = mean(weights, places)
    assert ess(weights) == pytest.approx(1 / 0.375)
    assert ess(np.full(8, 1 / 8)) == pytest.approx(8)
    assert center.tolist() == [1, 2]
    # xx: .5*1 + .25*9 + .25*1 = 3; yy: .5*4 + .25*4 + .25*36 = 12; xy: .5*2 - .25*6 - .25*6 = -2.
    assert covariance(weights, places, center) == pytest.approx(np.array([[3, -2], [-2, 12]]))


def test_kld_bound_by_hand() -> None:
    """Fox 2003, eq. 14, epsilon = .05, z = 2.326, k = 10: 90 (1 - 2/81 + sqrt(2/81) 2.326)^3 = 216.65."""
    bounds = kld_bound(np.array([1.0, 10.0]), 0.05, 2.326)
    root = sqrt(2 / 81)
    assert bounds == pytest.approx([1, 90 * (1 - 2 / 81 + root * 2.326) ** 3])
    # Twice epsilon n is about the chi-square quantile of k - 1 degrees (Wilson, Hilferty 1931).
    assert bounds[1] == pytest.approx(chi2.ppf(norm.cdf(2.326), 9) / (2 * 0.05), rel=0.003)


def test_kld_count_stops_at_the_first_that_suffices() -> None:
    together = np.zeros((100, 2))
    assert kld_count(together, 2, 1.0, 0.1, 2.0) == 2
    apart = np.arange(200).reshape(100, 2).astype(float)
    assert kld_count(apart, 2, 1.0, 0.1, 2.0) == 100
    # Ten cells and no more: the count is the bound for k = 10, rounded up.
    ten = np.stack([np.arange(100.0) % 10, np.zeros(100)], axis=1)
    bound = float(kld_bound(np.array([10.0]), 0.2, 2.0)[0])
    assert kld_count(ten, 2, 1.0, 0.2, 2.0) == int(np.ceil(bound))


def test_ess_count_by_hand() -> None:
    assert ess_count(100, 25.0, 50.0, 10, 1000) == 200
    assert ess_count(100, 25.0, 50.0, 10, 150) == 150
    assert ess_count(100, 99.0, 5.0, 10, 150) == 10
