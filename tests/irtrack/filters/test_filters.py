"""Resampling, motion and Kalman filters against closed forms."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import pytest

from irsim.types import Floats
from irtrack.filters import kalman
from irtrack.filters.motion import ar2, constant_velocity, coordinated_turn, random_walk_density
from irtrack.filters.resampling import RESAMPLERS, Resampling

WEIGHTS = np.array([0.05, 0.0, 0.3, 0.15, 0.5])
RUNS = 1000


@pytest.mark.parametrize("scheme", RESAMPLERS)
def test_resampling_is_unbiased(scheme: Resampling) -> None:
    """Index i comes n w_i times in the mean; the variance is at most multinomial, n w_i (1 - w_i)."""
    rng = np.random.default_rng(12)
    for n in (5, 2, 13):
        counts = np.array([np.bincount(RESAMPLERS[scheme](WEIGHTS, rng, n), minlength=5) for _ in range(RUNS)])
        assert (counts.sum(axis=1) == n).all()
        assert not counts[:, 1].any()
        binomial = n * WEIGHTS * (1 - WEIGHTS)
        assert (np.abs(counts.mean(axis=0) - n * WEIGHTS) <= 4 * np.sqrt(binomial / RUNS)).all()
        if scheme == "multinomial":  # the relative standard error of a variance from 1000 draws is some 5 %
            assert counts.var(axis=0) == pytest.approx(binomial, rel=0.2)
    heavy = np.eye(7)[3]
    assert RESAMPLERS[scheme](heavy, rng).tolist() == [3] * 7


@pytest.mark.parametrize(("scheme", "slack"), [("systematic", 1), ("residual", 5), ("stratified", 2)])
def test_low_variance_schemes_keep_bounds(scheme: Resampling, slack: int) -> None:
    """systematic: floor or ceil of N w_i; residual: at least the floor; stratified: less than 2 off."""
    n = len(WEIGHTS)
    for seed in range(100):
        counts = np.bincount(RESAMPLERS[scheme](WEIGHTS, np.random.default_rng(seed)), minlength=n)
        assert (np.abs(counts - n * WEIGHTS) < slack).all()
        if scheme == "residual":
            assert (counts >= np.floor(n * WEIGHTS)).all()


def test_undamped_ar2_spreads_as_the_closed_form() -> None:
    """Var x_n = R^2 sum_{k=1..n} k^2 = R^2 n (n+1) (2n+1) / 6; without noise x goes on by its damped displacement."""
    rng = np.random.default_rng(7)
    everyone = np.arange(20_000)
    now: Floats = np.zeros((20_000, 2))
    before = now
    for _ in range(6):
        now, before = ar2(now, before, everyone, 1.0, np.full(20_000, 2.0), rng)
    assert now.std(axis=0) == pytest.approx([2 * sqrt(6 * 7 * 13 / 6)] * 2, rel=0.02)
    moved, origin = ar2(np.array([[10.0, 5.0]]), np.array([[8.0, 6.0]]), np.array([0, 0]), 0.5, np.zeros(2), rng)
    assert moved.tolist() == [[11, 4.5]] * 2
    assert origin.tolist() == [[10, 5]] * 2


def test_constant_velocity_by_hand() -> None:
    F, Q = constant_velocity(2.0)
    assert (F @ np.array([10.0, 20, 3, -4])).tolist() == [13, 16, 3, -4]
    assert Q[0].tolist() == [1, 0, 2, 0]
    assert Q[2].tolist() == [2, 0, 4, 0]
    assert Q.T.tolist() == Q.tolist()


def test_first_update_by_hand() -> None:
    """P = 4, R = 1: gain .8; the mean goes from 0 to .8 of 5; P to .2 of 4."""
    mean, P = kalman.update(np.zeros(1), np.array([[4.0]]), np.array([5.0]), np.eye(1), np.eye(1))
    assert mean == pytest.approx([4])
    assert pytest.approx(np.array([[0.8]])) == P


def test_updated_covariance_any_gain_by_hand() -> None:
    """e - K (e + v) of one number: (1 - K)^2 P + K^2 R; least, P R / (P + R) = .8, at K = P / (P + R) = .8."""
    P, H, R = np.array([[4.0]]), np.eye(1), np.eye(1)
    for gain, expected in ((0.0, 4.0), (0.5, 1.25), (0.8, 0.8), (1.0, 1.0)):
        assert kalman.updated_covariance(P, np.array([[gain]]), H, R) == pytest.approx(np.array([[expected]]))


def test_steady_gain_is_that_of_kalata() -> None:
    """With tracking index L = q T^2 / r: s = (4 + L - sqrt(8 L + L^2)) / 4, alpha = 1 - s^2,
    beta = 2 (2 - alpha) - 4 sqrt(1 - alpha) (Kalata 1984)."""
    acceleration, deviation = 0.5, 2.0
    F, Q = constant_velocity(acceleration)
    H, R = np.eye(2, 4), deviation**2 * np.eye(2)
    mean: Floats = np.zeros(4)
    P: Floats = np.eye(4)
    for _ in range(200):
        mean, P = kalman.predict(mean, P, F, Q)
        mean, P = kalman.update(mean, P, np.zeros(2), H, R)
    _, P = kalman.predict(mean, P, F, Q)
    after, _ = kalman.update(np.zeros(4), P, np.array([1.0, 0.0]), H, R)
    index = acceleration / deviation
    s = (4 + index - sqrt(8 * index + index**2)) / 4
    alpha = 1 - s**2
    beta = 2 * (2 - alpha) - 4 * sqrt(1 - alpha)
    assert after == pytest.approx([alpha, 0, beta, 0], abs=1e-9)


def test_innovation_and_its_distance_by_hand() -> None:
    nu, S = kalman.innovation(
        np.array([1.0, 2, 0, 0]), np.diag([3.0, 8, 1, 1]), np.array([3.0, 5]), np.eye(2, 4), np.eye(2)
    )
    assert nu.tolist() == [2, 3]
    assert S.tolist() == [[4, 0], [0, 9]]
    assert kalman.squared_distance(nu, S) == pytest.approx(4 / 4 + 9 / 9)


def test_a_coordinated_turn_by_hand() -> None:
    """A quarter turn in one frame at speed pi / 2: along a circle of radius 1, from +x to +y."""
    moved, _ = coordinated_turn(np.array([3.0, 4.0, pi / 2, 0.0, pi / 2]))
    assert moved == pytest.approx([4, 5, 0, pi / 2, pi / 2])
    moved, _ = coordinated_turn(np.array([3.0, 4.0, 2.0, -1.0, 0.0]))
    assert moved == pytest.approx([5, 3, 2, -1, 0])


@pytest.mark.parametrize("rate", [0.0, -9.9e-5, 1.1e-4, -1.2])
def test_the_jacobian_of_a_turn_is_its_derivative(rate: float) -> None:
    state = np.array([3.0, 4.0, 2.0, -1.0, rate])
    _, jacobian = coordinated_turn(state)
    step = 1e-5
    for i in range(5):
        up, down = (coordinated_turn(state + sign * step * np.eye(5)[i])[0] for sign in (1, -1))
        assert jacobian[:, i] == pytest.approx((up - down) / (2 * step), abs=1e-6)


def test_density_of_a_walk_by_hand() -> None:
    """Origins at 0 and 6 px, radius 9 px, a place at 3 and one at 12: normal of deviation 3, or a disc."""
    places, origins = np.array([[3.0, 0.0], [12.0, 0.0]]), np.array([[0.0, 0.0], [6.0, 0.0]])
    normal = random_walk_density(places, origins, 9.0, "gaussian")
    assert normal == pytest.approx(np.array([exp(-0.5), (exp(-8) + exp(-2)) / 2]) / (2 * pi * 9))
    disc = random_walk_density(places, origins, 9.0, "disc")
    assert disc == pytest.approx(np.array([1, 0.5]) / (pi * 81))
