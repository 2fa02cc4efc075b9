"""Bound of a sequence: against the information form and a line fit; a filter of fits; scenes without one."""

from __future__ import annotations

import math

import numpy as np
import pytest

import irsim
from irsim.motion.base import Dynamics, constant_velocity
from irsim.motion.stochastic import Singer
from irsim.render.bounds import FrameInformation
from irsim.render.sequence_bound import filtered, mean_information, no_sequence_bound, picture_derivatives

SCENE = """
seed: 1
frames: 6
camera: {size: [64, 48], netd_mk: 40}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, contrast_k: 30}, path: {PATH, start: [20, 20], range_m: 3000}}
"""


def scene(path: str = "kind: straight, speed: 1", *changes: str) -> irsim.Scenario:
    return irsim.loads(SCENE.replace("PATH", path), overrides=changes)


def singer(sigma: float) -> Dynamics:
    """Return the law of a Singer path with a correlation time of 6 frames."""
    path = Singer.model_validate({"start": (0, 0), "sigma": sigma, "correlation_frames": 6.0})
    return path.dynamics(scene().context)


def test_line_fit_of_constant_velocity() -> None:
    """The last of n places on a line has the variance sigma² (4n - 2) / (n (n + 1)) without prior knowledge."""
    n, sigma = 12, 0.1
    information = np.broadcast_to(np.eye(2) / sigma**2, (n, 2, 2))
    found = filtered(constant_velocity(("x", "y")), range(n), information, 1e4, 1e4)
    expected = sigma**2 * (4 * n - 2) / (n * (n + 1)) * np.eye(2)
    np.testing.assert_allclose(found[-1], expected, rtol=1e-4, atol=1e-8)


def test_covariance_form_equals_the_information_form() -> None:
    """J(k+1) = (Q + F J(k)^-1 F')^-1 + H' J H (Tichavsky et al. 1998, eq. 34 with linear dynamics); a frame without
    information and a lost frame in between."""
    law = singer(0.3)
    F, Q = law.transitions[0], law.noises[0]
    frames = [0, 1, 2, 4, 5]
    rng = np.random.default_rng(3)
    parts = rng.standard_normal((5, 2, 3))
    information = parts @ parts.transpose(0, 2, 1)
    information[2] = 0
    P = np.diag([0.5**2, 2.0, 0.3**2] * 2)
    for k, J in enumerate(information):
        for _ in range(frames[k] - frames[k - 1] if k else 0):
            P = F @ P @ F.T + Q
        update = np.zeros((6, 6))
        update[np.ix_([0, 3], [0, 3])] = J
        P = np.linalg.inv(np.linalg.inv(P) + update)
        found = filtered(law, frames, information, 0.5, 2.0)[k]
        np.testing.assert_allclose(found, P[np.ix_([0, 3], [0, 3])], rtol=1e-6)


def test_sequence_never_exceeds_the_frame_or_the_start() -> None:
    rows = irsim.bounds(scene("kind: singer, speed: 1, sigma: 0.05"), start_error_px=0.02, draws=2)
    assert len(rows) == 6
    for row in rows:
        assert row.sd_x_sequence is not None
        assert row.sd_x_sequence < 1.05 * row.sd_x  # the information is the mean over paths
    assert rows[0].sd_x_sequence is not None
    assert rows[0].sd_x_sequence < 0.02


def test_zoom_magnifies_the_place() -> None:
    """H is the zoom in each frame: pixels of the unmoved camera are larger."""
    zoomed = scene("kind: straight, speed: 0", "camera.motion=[{kind: zoom, factors: [[0, 1], [4, 2]]}]")
    found = picture_derivatives(FrameInformation(zoomed), "a", range(6))
    expected = [factor * np.eye(2) for factor in (1, 2**0.25, 2**0.5, 2**0.75, 2, 2)]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("path", "changes", "reason"),
    [
        ("kind: stop_and_go", (), "its path has no linear law"),
        ("kind: jump", (), "its path switches between several laws"),
        (
            "kind: straight",
            ("camera.noise=[{kind: white}, {kind: ar1, rho: 0.9}]",),
            "the noise ar1 depends on earlier",
        ),
        (
            "kind: straight",
            ("camera.noise=[{kind: white}, {kind: fixed_pattern}]",),
            "fixed pattern fixed_pattern is un",
        ),
        ("kind: straight", ("camera.time_constant_ms=20",), "the detector's response time mixes frames"),
    ],
)
def test_scenes_without_a_sequence_bound_say_so(path: str, changes: tuple[str, ...], reason: str) -> None:
    scenario = scene(path, *changes)
    found = no_sequence_bound(scenario, "a")
    assert found is not None
    assert reason in found
    rows = irsim.bounds(scenario, stop=1, start_error_px=1.0)
    assert rows[0].sd_x_sequence is None
    assert rows[0].sd_x > 0


def test_law_in_metres_has_none() -> None:
    path = "{kind: straight_m, start_m: [0, 0, 900], velocity_m_s: [5, 0, 0]}"
    text = SCENE.replace("{PATH, start: [20, 20], range_m: 3000}", path)
    assert no_sequence_bound(irsim.loads(text), "a") == "the law of its path is in metres"


def test_filter_of_fits_reaches_the_bound_of_its_information() -> None:
    """A Kalman filter with measurements of covariance J^-1 has the bound's covariance: mean square of 400 runs."""
    law = singer(0.2)
    F, Q, R, n = law.transitions[0], law.noises[0], np.diag([0.09, 0.04]), 15
    rng, runs = np.random.default_rng(9), 400
    bound = filtered(law, range(n), np.broadcast_to(np.linalg.inv(R), (n, 2, 2)), 0.5, 1.0)
    P = np.diag([0.25, 0.5, 0.04] * 2)
    truth = rng.multivariate_normal(np.zeros(6), P, runs)
    estimate = np.zeros((runs, 6))
    H = np.eye(6)[[0, 3]]
    for k in range(n):
        if k:
            truth = truth @ F.T + rng.multivariate_normal(np.zeros(6), Q, runs)
            estimate, P = estimate @ F.T, F @ P @ F.T + Q
        z = truth @ H.T + rng.multivariate_normal(np.zeros(2), R, runs)
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        estimate = estimate + (z - estimate @ H.T) @ K.T
        P = P - K @ H @ P
    errors = (truth - estimate)[:, [0, 3]] / np.sqrt(np.diag(bound[-1]))
    assert np.sqrt((errors**2).mean()) == pytest.approx(1, abs=4 / math.sqrt(4 * runs))


def test_information_averages_paths_of_following_seeds() -> None:
    scenario = scene("kind: singer, speed: 1, sigma: 0.3")
    mean = mean_information(FrameInformation(scenario), "a", range(6), 2)
    each = [
        mean_information(FrameInformation(scenario.model_copy(update={"seed": seed})), "a", range(6), 1)
        for seed in (1, 2)
    ]
    np.testing.assert_allclose(mean, np.mean(each, axis=0))
    assert not np.allclose(each[0], each[1])
