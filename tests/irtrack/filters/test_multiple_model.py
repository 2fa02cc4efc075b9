"""Kalman filters of many tracks and the interacting multiple model, against filterpy and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from oracle_cases import turning_target
from oracles import values_of

from irsim.types import Floats
from irtrack.filters.kalman import predict, update
from irtrack.filters.motion import constant_velocity
from irtrack.filters.multiple_model import (
    Model,
    MultipleModel,
    constant_acceleration_model,
    constant_velocity_model,
    coordinated_turn_model,
    densities,
    moved,
    update_mixture,
)
from irtrack.filters.multiple_model import update as update_many

R = np.eye(2)


@pytest.mark.parametrize("seed", range(len(values_of("filterpy"))))
def test_imm_equals_filterpy(seed: int) -> None:
    case, expected = turning_target(seed), values_of("filterpy")[seed]
    models = [
        constant_velocity_model(case["acceleration"]),
        *(coordinated_turn_model(sign * case["rate"], case["acceleration"]) for sign in (1, -1)),
    ]
    bank = MultipleModel.of(models, case["stay"])
    states = bank.started(case["detections"][:1], np.ones((1, 2)), 2.0)
    for detection, place, model in zip(case["detections"][1:], expected["places"], expected["models"], strict=True):
        states = update_many(bank.predict(states), detection[None], R)
        np.testing.assert_allclose(states.moments()[0][0, :2], place, rtol=1e-9)
        np.testing.assert_allclose(states.probability[0], model, atol=1e-9)


def test_one_model_is_the_plain_kalman_filter() -> None:
    F, Q = constant_velocity(0.3)
    bank = MultipleModel.of([constant_velocity_model(0.3)], 1.0)
    states = bank.started(np.array([[4.0, 5.0]]), np.ones((1, 2)), 2.0)
    mean, P = np.array([4.0, 5.0, 0, 0]), np.diag([1.0, 1.0, 4.0, 4.0])
    for z in np.random.default_rng(1).normal(5, 2, (12, 2)):
        states = update_many(bank.predict(states), z[None], R)
        mean, P = update(*predict(mean, P, F, Q), z, np.eye(2, 4), R)
    np.testing.assert_allclose(states.mean[0, 0, :4], mean, rtol=1e-9)
    np.testing.assert_allclose(states.covariance[0, 0, :4, :4], P, rtol=1e-9)


@pytest.mark.parametrize(
    ("model", "state", "after"),
    [
        (constant_velocity_model(0.1), [1, 2, 3, 4, 9, 9], [4, 6, 3, 4, 0, 0]),
        (constant_acceleration_model(0.1), [0, 0, 1, 0, 2, 0], [2, 0, 3, 0, 2, 0]),
        (coordinated_turn_model(np.pi / 2, 0.1), [0, 0, np.pi / 2, 0, 0, 0], [1, 1, 0, np.pi / 2, -(np.pi**2) / 4, 0]),
    ],
)
def test_models_move_as_their_formula(model: Model, state: list[float], after: list[float]) -> None:
    np.testing.assert_allclose(model.F @ state, after, atol=1e-12)
    np.testing.assert_allclose(model.Q, model.Q.T)
    assert np.linalg.eigvalsh(model.Q).min() > -1e-12


def test_a_turn_raises_the_probability_of_its_model() -> None:
    case = turning_target(3)
    bank = MultipleModel.of([constant_velocity_model(0.05), coordinated_turn_model(0.15, 0.05)], 0.95)
    states = bank.started(case["detections"][:1], np.ones((1, 2)), 2.0)
    turning = []
    for z in case["detections"][1:]:
        states = update_many(bank.predict(states), z[None], R)
        turning.append(states.probability[0, 1])
    assert turning[-1] > 0.8 > turning[8]
    assert np.linalg.eigvalsh(states.covariance[0, 0]).min() > 0


@pytest.mark.parametrize("models", [1, 2])
def test_mixture_of_one_sure_detection_is_the_update(models: int) -> None:
    bank = MultipleModel.of([constant_velocity_model(0.1), constant_velocity_model(2.0)][:models], 0.9)
    states = bank.predict(bank.started(np.array([[0.0, 0], [9, 9]]), np.ones((2, 2)), 1.0))
    z = np.array([[1.0, 0.5], [8.5, 9]])
    one, other = update_many(states, z, R), update_mixture(states, z, R, np.eye(2))
    for name in ("mean", "covariance", "probability"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-9, atol=1e-12)


def test_mixture_without_detections_is_the_prediction() -> None:
    bank = MultipleModel.of([constant_velocity_model(0.1), constant_velocity_model(2.0)], 0.9)
    states = bank.predict(bank.started(np.zeros((1, 2)), np.ones((1, 2)), 1.0))
    after = update_mixture(states, np.zeros((0, 2)), R, np.zeros((1, 0)))
    np.testing.assert_allclose(after.mean, states.mean)
    np.testing.assert_allclose(after.covariance, states.covariance)


def test_density_of_a_mixture_integrates_to_one() -> None:
    bank = MultipleModel.of([constant_velocity_model(0.1), constant_velocity_model(3.0)], 0.7)
    states = bank.predict(bank.started(np.zeros((1, 2)), np.ones((1, 2)), 1.0))
    x = np.linspace(-25, 25, 201)
    grid = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    _, density = densities(states, R, grid)
    assert np.exp(density).sum() * (x[1] - x[0]) ** 2 == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("models", [1, 2])
def test_states_follow_the_homography_of_a_camera(models: int) -> None:
    """Sampled states that are mapped one by one have the moments of `moved`."""
    bank = [constant_velocity_model(0.3, 4)] if models == 1 else [constant_velocity_model(0.3)] * 2
    states = MultipleModel.of(bank, 0.9).started(np.array([[40.0, 200.0], [300.0, 10.0]]), np.full((2, 2), 0.04), 0.1)
    states.mean[..., 2:4] = 1.5, -2.0
    H = np.array([[0.95, -0.3, 12.0], [0.28, 1.05, -7.0], [1e-4, -2e-4, 1.0]])
    after = moved(states, H)
    rng = np.random.default_rng(0)
    for track, model in np.ndindex(2, models):
        mean, covariance = states.mean[track, model], states.covariance[track, model]
        samples = rng.multivariate_normal(mean, covariance, 20_000)
        ends = samples[:, :2] + 1e-3 * samples[:, 2:4]
        here, there = (_mapped(H, each) for each in (samples[:, :2], ends))
        found = np.concatenate([here, (there - here) / 1e-3], axis=1)
        np.testing.assert_allclose(after.mean[track, model, :4], found.mean(axis=0), atol=0.02)
        np.testing.assert_allclose(after.covariance[track, model, :4, :4], np.cov(found.T), atol=2e-3)


def _mapped(H: Floats, pixels: Floats) -> Floats:
    found = np.concatenate([pixels, np.ones((len(pixels), 1))], axis=1) @ H.T
    return np.asarray(found[:, :2] / found[:, 2:])
