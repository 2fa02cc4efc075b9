"""Weights of particles by Bayes' rule, against closed forms; and what holds of any."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tracker_loops import plain

from irsim.types import Floats
from irtrack.filters.particle import neff, reweigh, shares
from irtrack.registry.table import fusion_wspf


def test_weights_by_hand() -> None:
    """Priors .25, .5, .25; likelihoods as 1 to e^-1 to e^-2: the logarithms are half the scores."""
    weights = reweigh(np.array([0.25, 0.5, 0.25]), np.array([6.0, 4.0, 2.0]), 0.5)
    assert weights is not None
    total = 0.25 + 0.5 * exp(-1) + 0.25 * exp(-2)
    assert weights == pytest.approx(np.array([0.25, 0.5 * exp(-1), 0.25 * exp(-2)]) / total)


@pytest.mark.parametrize("sharpness", [2e4, 1e9])
def test_the_dead_stay_dead_however_well_they_score(sharpness: float) -> None:
    """The best score is a dead particle's, beside which the others' likelihoods are nothing in floating point."""
    prior, score = np.array([0.0, 0.5, 0.5]), np.array([0.95, 0.4, 0.2])
    weights = reweigh(prior, score, sharpness)
    with plain():
        plainly = reweigh(prior, score, sharpness)
    assert weights is not None
    assert plainly is not None
    assert weights.tolist() == plainly.tolist() == [0, 1, 0]


def test_a_dead_particle_does_not_revive_in_the_fused_filter() -> None:
    """sigma = .02: .3 and .2 are as 1 to exp(-.1 / .0008) = exp(-125); .95 weighed nothing before."""
    weights, in_view = fusion_wspf.weigh(np.array([0.0, 0.5, 0.5]), np.array([0.95, 0.3, 0.2]), np.ones(3), 0.02)
    assert in_view
    assert weights == pytest.approx([0, 1, exp(-125)], rel=1e-12, abs=0)


def test_many_sets_at_once_are_each_as_if_alone() -> None:
    rng = np.random.default_rng(4)
    prior, score = rng.dirichlet(np.ones(7), (2, 3)), rng.normal(0, 50, (2, 3, 7))
    prior[0, 1, :6] = 0
    weights = reweigh(prior, score)
    assert weights is not None
    for at in np.ndindex(2, 3):
        alone = reweigh(prior[at], score[at])
        assert alone is not None
        assert weights[at] == pytest.approx(alone, rel=1e-14)
        assert neff(weights)[at] == pytest.approx(1 / (alone**2).sum(), rel=1e-14)


def test_nothing_left_is_told() -> None:
    nothing, dead = np.zeros(3), np.full(3, -np.inf)
    rows = np.stack([np.full(3, 1 / 3), nothing])
    for prior, score in ((nothing, np.ones(3)), (np.ones(3), dead), (np.array([1.0, 0, 0]), np.array([-np.inf, 1, 2]))):
        assert reweigh(prior, score) is None
        with plain():
            assert reweigh(prior, score) is None
    assert reweigh(rows, np.zeros((2, 3))) is None
    assert shares(nothing) is None
    halves = shares(np.array([2.0, 2.0]))
    assert halves is not None
    assert halves.tolist() == [0.5, 0.5]


@st.composite
def evidence(draw: st.DrawFn) -> tuple[Floats, Floats]:
    """Priors, some of them 0, and scores far apart."""
    count = draw(st.integers(1, 40))
    prior = draw(st.lists(st.just(0.0) | st.floats(1e-12, 1), min_size=count, max_size=count))
    score = draw(st.lists(st.floats(-1e4, 1e4), min_size=count, max_size=count))
    return np.array(prior), np.array(score)


@given(evidence(), st.floats(0, 100), st.floats(-1e4, 1e4))
def test_what_holds_of_any_weights(given: tuple[Floats, Floats], sharpness: float, constant: float) -> None:
    """They sum to one; who weighed nothing weighs nothing; a constant added to all scores changes nothing."""
    prior, score = given
    assume(prior.any())
    weights, moved = reweigh(prior, score, sharpness), reweigh(prior, score + constant, sharpness)
    with plain():
        plainly = reweigh(prior, score, sharpness)
    assert weights is not None
    assert moved is not None
    assert plainly is not None
    assert weights.tolist() == plainly.tolist()
    assert weights.sum() == pytest.approx(1, rel=1e-12)
    assert (weights[prior == 0] == 0).all()
    assert weights.min() >= 0
    # Sums of up to 2e4 round by 2e-12 at most, and so do two of them beside each other.
    assert moved == pytest.approx(weights, rel=1e-11 * max(sharpness, 1), abs=1e-300)
