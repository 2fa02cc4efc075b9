"""Resampling, motion and Kalman filters against closed forms."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from irtrack.filters.adaptive import kld_bound, kld_count, neff_count
from scipy.stats import chi2, norm

from irsim.types import Floats
from irtrack.filters import kalman
from irtrack.filters import particle as particles
from irtrack.filters.motion import ar2, constant_velocity
from irtrack.filters.resampling import RESAMPLERS, Resampling

WEIGHTS = np.array([0.05, 0.0, 0.3, 0.15, 0.5])
RUNS = 4000


@pytest.mark.parametrize("scheme", RESAMPLERS)
def test_resampling_is_unbiased(scheme: Resampling) -> None:
    """Index i comes N w_i times in the mean; the variance is at most multinomial, N w_i (1 - w_i)."""
    n = len(WEIGHTS)
    rng = np.random.default_rng(12)
    counts = np.array([np.bincount(RESAMPLERS[scheme](WEIGHTS, rng), minlength=n) for _ in range(RUNS)])
    assert (counts.sum(axis=1) == n).all()
    assert not counts[:, 1].any()
    error = np.sqrt(n * WEIGHTS * (1 - WEIGHTS) / RUNS)
    assert (np.abs(counts.mean(axis=0) - n * WEIGHTS) <= 4 * error).all()


def test_multinomial_counts_have_binomial_variance() -> None:
    rng = np.random.default_rng(3)
    n = len(WEIGHTS)
    counts = np.array([np.bincount(RESAMPLERS["multinomial"](WEIGHTS, rng), minlength=n) for _ in range(RUNS)])
    # The relative standard error of a variance from 4000 draws is about sqrt(2 / 4000) = 2 %.
    assert counts.var(axis=0) == pytest.approx(n * WEIGHTS * (1 - WEIGHTS), rel=0.1)


@pytest.mark.parametrize(("scheme", "slack"), [("systematic", 1), ("residual", 5), ("stratified", 2)])
def test_low_variance_schemes_keep_their_bounds(scheme: Resampling, slack: int) -> None:
    """systematic: floor or ceil of N w_i; residual: at least the floor; stratified: less than 2 off."""
    n = len(WEIGHTS)
    for seed in range(300):
        counts = np.bincount(RESAMPLERS[scheme](WEIGHTS, np.random.default_rng(seed)), minlength=n)
        assert (np.abs(counts - n * WEIGHTS) < slack).all()
        if scheme == "residual":
            assert (counts >= np.floor(n * WEIGHTS)).all()


@pytest.mark.parametrize("scheme", RESAMPLERS)
@pytest.mark.parametrize("count", [2, 13])
def test_resampling_draws_as_many_as_asked(scheme: Resampling, count: int) -> None:
    rng = np.random.default_rng(5)
    counts = np.array([np.bincount(RESAMPLERS[scheme](WEIGHTS, rng, count), minlength=5) for _ in range(RUNS)])
    assert (counts.sum(axis=1) == count).all()
    error = np.sqrt(count * WEIGHTS * (1 - WEIGHTS) / RUNS)
    assert (np.abs(counts.mean(axis=0) - count * WEIGHTS) <= 4 * error).all()


@pytest.mark.parametrize("scheme", RESAMPLERS)
def test_one_heavy_particle_takes_all(scheme: Resampling) -> None:
    weights = np.zeros(7)
    weights[3] = 1.0
    assert RESAMPLERS[scheme](weights, np.random.default_rng(0)).tolist() == [3] * 7


@pytest.mark.parametrize("scheme", RESAMPLERS)
def test_equal_weights_and_residual_keep_each_index_in_range(scheme: Resampling) -> None:
    weights = np.full(10, 0.1)
    drawn = RESAMPLERS[scheme](weights, np.random.default_rng(2))
    assert drawn.shape == (10,)
    assert drawn.min() >= 0
    assert drawn.max() <= 9


def test_neff_mean_and_covariance_by_hand() -> None:
    weights = np.array([0.5, 0.25, 0.25])
    places = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 8.0]])
    center = particles.mean(weights, places)
    assert particles.neff(weights) == pytest.approx(1 / 0.375)
    assert particles.neff(np.full(8, 1 / 8)) == pytest.approx(8)
    assert center.tolist() == [1, 2]
    # xx: .5*1 + .25*9 + .25*1 = 3; yy: .5*4 + .25*4 + .25*36 = 12; xy: .5*2 - .25*6 - .25*6 = -2.
    assert particles.covariance(weights, places, center) == pytest.approx(np.array([[3, -2], [-2, 12]]))


def test_ar2_by_hand() -> None:
    now, before = np.array([[10.0, 5.0]]), np.array([[8.0, 6.0]])
    noise = np.array([[0.25, -0.5]])
    assert ar2(now, before, 1.0, noise).tolist() == [[12.25, 3.5]]
    assert ar2(now, before, 0.5, noise).tolist() == [[11.25, 4.0]]
    assert ar2(now, before, 0.0, noise).tolist() == [[10.25, 4.5]]


def test_undamped_ar2_spreads_as_the_closed_form() -> None:
    """Var x_n = R^2 sum_{k=1..n} k^2 = R^2 n (n+1) (2n+1) / 6."""
    rng = np.random.default_rng(7)
    now: Floats = np.zeros((20_000, 2))
    before = now
    for _ in range(6):
        now, before = ar2(now, before, 1.0, 2.0 * rng.standard_normal(now.shape)), now
    assert now.std(axis=0) == pytest.approx([2 * sqrt(6 * 7 * 13 / 6)] * 2, rel=0.02)


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


def test_covariance_after_any_gain_by_hand() -> None:
    """e - K (e + v) of one number: (1 - K)^2 P + K^2 R; least, P R / (P + R) = .8, at K = P / (P + R) = .8."""
    P, H, R = np.array([[4.0]]), np.eye(1), np.eye(1)
    for gain, expected in ((0.0, 4.0), (0.5, 1.25), (0.8, 0.8), (1.0, 1.0)):
        assert kalman.covariance_after(P, np.array([[gain]]), H, R) == pytest.approx(np.array([[expected]]))


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
    assert kalman.distance2(nu, S) == pytest.approx(4 / 4 + 9 / 9)


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


def test_neff_count_by_hand() -> None:
    assert neff_count(100, 25.0, 50.0, 10, 1000) == 200
    assert neff_count(100, 25.0, 50.0, 10, 150) == 150
    assert neff_count(100, 99.0, 5.0, 10, 150) == 10
