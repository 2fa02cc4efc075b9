"""The H-infinity filter: the Kalman filter at theta 0, filterpy, and its bound under the worst disturbances."""

from __future__ import annotations

import numpy as np
import pytest
from oracle_cases import straight_target
from oracles import values_of
from tracker_scenes import blob, follow

from irsim.types import Box, Floats
from irtrack.filters.motion import constant_velocity
from irtrack.registry.table import make
from irtrack.trackers.h_infinity import HInfinity

STEPS = 12


@pytest.mark.parametrize("measurement", ["centroid", "ncc", "mean_shift"])
def test_theta_0_is_the_kalman_filter(measurement: str) -> None:
    scene = blob(1, count=20, hidden=range(8, 11))
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    switches: dict[str, dict[str, float]] = {"h_infinity": {"theta": 0}, "kalman": {}}
    ours, theirs = (
        follow(make(name, {"measurement": measurement, **switch}), frames, box) for name, switch in switches.items()
    )
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one.center, other.center, atol=1e-10, rtol=0)
        np.testing.assert_allclose(np.asarray(one.covariance), np.asarray(other.covariance), atol=1e-10)
        assert one.status == other.status


@pytest.mark.parametrize("seed", range(len(values_of("filterpy_hinfinity"))))
def test_states_equal_filterpy(seed: int) -> None:
    case = straight_target(seed)
    tracker = HInfinity(
        acceleration=case["acceleration"], measurement_sd=case["measurement_sd"], theta=case["theta"], speed_weight=1
    )
    mean, covariance = np.array([*case["detections"][0], 0.0, 0.0]), np.diag([4.0, 4, 9, 9])
    states = values_of("filterpy_hinfinity")[seed]["states"]
    for detection, expected in zip(case["detections"][1:], states, strict=True):
        mean, covariance = tracker.predict(*tracker.updated(mean, covariance, detection))
        np.testing.assert_allclose(mean, expected, atol=1e-8)


def worst_ratio(tracker: HInfinity, theta: float | None) -> float:
    """Return the largest ratio of squared prediction errors of place to squared disturbances, in units of P, Q, R.

    Errors are weighted by `theta`, or by the tracker's own in each step. They depend linearly on the disturbances: the
    ratio is the largest singular value, squared.
    """
    F, _ = constant_velocity(1.0)
    G = tracker.acceleration * np.array([[0.5, 0], [0, 0.5], [1, 0], [0, 1]])
    first: Floats = np.diag([4.0, 4, 9, 9])
    columns = []
    for unit in np.eye(4 + 4 * STEPS):
        noise, errors = unit[4:].reshape(STEPS, 4), []
        x: Floats = np.sqrt(first) @ unit[:4]
        mean: Floats = np.zeros(4)
        covariance = first
        for k in range(STEPS):
            weight = tracker.feasible_theta(covariance) if theta is None else theta
            errors.append(np.sqrt(weight) * (x - mean)[:2])
            place = x[:2] + tracker.measurement_sd * noise[k, 2:]
            mean, covariance = tracker.predict(*tracker.updated(mean, covariance, place))
            x = F @ x + G @ noise[k, :2]
        columns.append(np.ravel(errors))
    return float(np.linalg.svd(np.array(columns), compute_uv=False)[0] ** 2)


def test_worst_disturbances_keep_the_bound() -> None:
    """Errors weighted by theta cost less than the disturbances; a theta at which the Kalman filter's cost more."""
    for share in (0.5, 0.9, 0.99):
        assert worst_ratio(HInfinity(share=share), None) < 1
    theta = 0.1
    assert worst_ratio(HInfinity(theta=theta), theta) < 1 < worst_ratio(HInfinity(theta=0.0), theta)


def test_theta_stays_feasible() -> None:
    """A theta that is not feasible is replaced by a share of the largest: covariances stay positive and larger."""
    plain, bold = HInfinity(theta=0.0), HInfinity(theta=1e6, speed_weight=1)
    start: tuple[Floats, Floats] = (np.zeros(4), np.diag([4.0, 4, 9, 9]))
    small = large = start
    for k in range(30):
        place = np.array([k, 0.5 * k])
        small, large = (t.updated(*t.predict(*state), place) for t, state in ((plain, small), (bold, large)))
        assert np.linalg.eigvalsh(large[1] - small[1]).min() > 0
