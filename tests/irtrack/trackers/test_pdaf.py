"""Probabilistic data association: probabilities against Stone Soup, the Kalman filter as its limit, clutter, cues."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from oracle_cases import one_gate
from oracles import values_of

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.filters.kalman import update
from irtrack.trackers.pdaf import PDAF, PDAFState
from irtrack.types import Detections

FRAMES = [Frame(np.full((120, 160), 50, np.uint8), k, k / 30, 8) for k in range(41)]
PLAIN: dict[str, Any] = {"amplitude": False, "direction": False}


@dataclass(frozen=True)
class Plots:
    """Detector that gives listed centres (m, 2) px and scores (m,) of each frame."""

    frames: list[tuple[np.ndarray, np.ndarray]]

    def step(self, state: None, frame: Frame) -> tuple[None, Detections]:
        centers, scores = self.frames[frame.index]
        return None, Detections(centers, np.full(centers.shape, 5.0), scores)


def begun(tracker: PDAF, at: np.ndarray, frames: list[tuple[np.ndarray, np.ndarray]]) -> PDAFState:
    state = tracker.init(FRAMES[0], Box(float(at[0]), float(at[1]), 7, 7), stream(0, 0))
    return replace(state, detector=Plots(frames))


def found(centers: np.ndarray, scores: np.ndarray) -> Detections:
    return Detections(centers, np.full(centers.shape, 5.0), scores)


@pytest.mark.parametrize("seed", range(len(values_of("stonesoup_pda"))))
def test_probabilities_equal_stone_soup(seed: int) -> None:
    case = one_gate(seed)
    tracker = PDAF(**PLAIN, gate=1e4, detection_probability=case["detection_probability"], clutter=case["clutter"])
    mean, covariance = np.append(case["center"], [0.0, 0.0]), np.eye(4)
    covariance[:2, :2] = case["covariance"]
    state = begun(tracker, case["center"], [])
    beta = tracker.probabilities(state, mean, covariance, found(case["detections"], np.ones(len(case["detections"]))))
    np.testing.assert_allclose(beta, values_of("stonesoup_pda")[seed]["beta"], atol=1e-9)


def test_one_certain_detection_gives_the_kalman_filter() -> None:
    """P_D = P_G = 1 and no clutter."""
    tracker = PDAF(**PLAIN, gate=1e4, detection_probability=1.0, clutter=1e-12)
    plots = [(np.array([[60 + 1.5 * k, 50 - k]]), np.ones(1)) for k in range(10)]
    state = begun(tracker, np.array([60.0, 50.0]), plots)
    mean, covariance = state.mean, state.covariance
    for k in range(1, 10):
        state, estimate = tracker.step(state, FRAMES[k], stream(0, k))
        mean, covariance = tracker.predict(mean, covariance)
        mean, covariance = update(mean, covariance, plots[k][0][0], np.eye(2, 4), np.eye(2))
        np.testing.assert_allclose(state.mean, mean, atol=1e-9)
        np.testing.assert_allclose(state.covariance, covariance, atol=1e-9)
        assert estimate.score == pytest.approx(1)


@pytest.mark.parametrize("clutter", [0.002, None])
def test_normalised_error_in_clutter(clutter: float | None) -> None:
    """The mean over 40 tracks of 40 frames, .002 false detections per px^2, is that of two degrees of freedom."""
    tracker = PDAF(**PLAIN, acceleration=0.2, clutter=clutter)
    noise = np.array([[0.5, 0], [0, 0.5], [1, 0], [0, 1]])
    F = np.block([[np.eye(2), np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    squares, lost = [], 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        x, states, plots = np.array([80.0, 60.0, *rng.normal(0, 1, 2)]), [], []
        for _ in FRAMES:
            false = rng.uniform((0, 0), (160, 120), (rng.poisson(0.002 * 160 * 120), 2))
            own = x[None, :2] + rng.normal(0, 1, (1, 2)) if rng.random() < 0.9 else np.empty((0, 2))
            plots.append((np.concatenate([own, false]), np.ones(len(own) + len(false))))
            states.append(x)
            x = F @ x + 0.2 * noise @ rng.standard_normal(2)
        state = begun(tracker, states[0][:2] + rng.normal(0, 1, 2), plots)
        errors = []
        for k in range(1, len(FRAMES)):
            state, estimate = tracker.step(state, FRAMES[k], stream(0, k))
            off = np.subtract(estimate.center, states[k][:2])
            assert estimate.covariance is not None
            errors.append(off @ np.linalg.solve(estimate.covariance, off))
        lost += np.hypot(*off) > 20
        squares += errors if np.hypot(*off) <= 20 else []
    assert lost <= 4
    assert 1.4 < np.mean(squares) < 2.8


def test_score_and_direction_tell_detections_apart() -> None:
    """Two detections equally far from the prediction: one of the target's score, or ahead on its way."""
    mean, covariance = np.array([50.0, 50, 4, 0]), np.diag([9.0, 9, 1, 1])

    def share(centers: list[tuple[float, float]], scores: list[float], **switches: Any) -> float:
        tracker = PDAF(**(PLAIN | switches))
        state = begun(tracker, np.array([46.0, 50.0]), [])
        state = replace(state, level=30.0, false_level=6.0, mean=mean - (4, 0, 0, 0))
        beta = tracker.probabilities(state, mean, covariance, found(np.array(centers), np.array(scores)))
        return float(beta[0] / beta.sum())

    level = [(50.0, 48.0), (50.0, 52.0)]
    assert share(level, [30, 6]) == pytest.approx(0.5)
    assert share(level, [30, 6], amplitude=True) > 0.99
    along = [(52.0, 50.0), (46.0, 52.0)]
    assert share(along, [9, 9], direction=True) > share(along, [9, 9]) + 0.05
    slow = PDAF(**(PLAIN | {"direction": True}))
    state = replace(begun(slow, np.array([46.0, 50.0]), []), mean=mean - (4, 0, 3.5, 0))
    both = found(np.array(along), np.ones(2))
    beta = slow.probabilities(state, mean - (0, 0, 3.5, 0), covariance, both)
    plain = PDAF(**PLAIN).probabilities(state, mean - (0, 0, 3.5, 0), covariance, both)
    np.testing.assert_array_equal(beta, plain)
