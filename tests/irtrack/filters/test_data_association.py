"""Association of detections with tracks, against Stone Soup and lists of all assignments."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracle_cases import shared_gates
from oracles import values_of
from scipy.optimize import linear_sum_assignment

from irtrack.filters.data_association import joint_probabilities, k_best, nearest_neighbours
from irtrack.filters.multiple_model import States, densities


@pytest.mark.parametrize("seed", range(len(values_of("stonesoup"))))
def test_joint_probabilities_equal_stone_soup(seed: int) -> None:
    case = shared_gates(seed)
    count = len(case["centers"])
    mean, covariance = np.zeros((count, 1, 6)), np.zeros((count, 1, 6, 6))
    mean[:, 0, :2] = case["centers"]
    covariance[:, 0, 0, 0] = covariance[:, 0, 1, 1] = case["variances"]
    _, density = densities(States(mean, covariance, np.ones((count, 1))), np.eye(2), case["detections"])
    beta = joint_probabilities(density + np.log(0.9 / 0.1 / 0.01))
    np.testing.assert_allclose(beta, np.reshape(values_of("stonesoup")[seed]["beta"], beta.shape), atol=1e-9)


def test_approximation_of_large_clusters_is_near() -> None:
    """Fitzgerald's weights keep the most likely detection of each track, and no sum is above 1."""
    rng = np.random.default_rng(2)
    places = rng.uniform(0, 20, (5, 2))
    apart = np.hypot(*(places[:, None] - (places + rng.normal(0, 0.7, (5, 2)))[None]).transpose(2, 0, 1))
    L = 4 - apart**2
    exact, near = joint_probabilities(L), joint_probabilities(L, events=1)
    assert (exact.argmax(axis=1) == near.argmax(axis=1)).all()
    assert np.abs(exact - near).max() < 0.15
    assert near.sum(axis=1).max() <= 1


@st.composite
def tables(draw: st.DrawFn) -> np.ndarray:
    rows, columns = draw(st.integers(1, 4)), draw(st.integers(1, 5))
    values = st.floats(-8, 8).filter(lambda value: abs(value) > 1e-6) | st.just(-np.inf)
    return np.array(draw(st.lists(values, min_size=rows * columns, max_size=rows * columns))).reshape(rows, columns)


@given(tables())
def test_nearest_neighbours_have_the_largest_sum(L: np.ndarray) -> None:
    pairs = nearest_neighbours(L)
    gain = np.maximum(L, 0.0)
    rows, columns = linear_sum_assignment(gain, maximize=True)
    assert L[pairs[:, 0], pairs[:, 1]].sum() == pytest.approx(gain[rows, columns].sum())
    assert len(set(pairs[:, 0])) == len(set(pairs[:, 1])) == len(pairs)


@given(tables())
def test_joint_probabilities_are_those_of_all_events(L: np.ndarray) -> None:
    ratios = np.exp(L)
    sums, total = np.zeros(L.shape), 0.0
    for event in itertools.product(range(-1, L.shape[1]), repeat=len(L)):
        taken = [j for j in event if j >= 0]
        if len(taken) == len(set(taken)):
            weight = float(np.prod([ratios[i, j] for i, j in enumerate(event) if j >= 0]))
            total += weight
            for i, j in enumerate(event):
                sums[i, j] += weight if j >= 0 else 0
    np.testing.assert_allclose(joint_probabilities(L), sums / total, atol=1e-9)


@given(tables())
def test_k_best_lists_assignments_in_order(L: np.ndarray) -> None:
    cost = np.concatenate([-L, np.where(np.eye(len(L)) > 0, 0.0, np.inf)], axis=1)
    every = sorted(
        total
        for columns in itertools.permutations(range(cost.shape[1]), len(cost))
        if np.isfinite(total := float(sum(cost[i, j] for i, j in enumerate(columns))))
    )
    found = [each.cost for each in k_best(cost, 12)]
    np.testing.assert_allclose(found, every[:12], atol=1e-9)
    within = [each.cost for each in k_best(cost, 12, every[0] + 2)]
    np.testing.assert_allclose(within, [each for each in every[:12] if each <= every[0] + 2], atol=1e-9)
