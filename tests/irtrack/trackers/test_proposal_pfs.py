"""Particle filters by their proposals: upf, likelihood_pf, and grey_pf with two groups of particles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tracker_scenes import Scene, blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.filters import kalman
from irtrack.filters.motion import random_walk_density
from irtrack.filters.multiple_model import white_acceleration_model
from irtrack.filters.particle import Weights
from irtrack.registry.table import make
from irtrack.trackers.grey_pf import GreyPF
from irtrack.trackers.likelihood_pf import LikelihoodPF
from irtrack.trackers.upf import UPF


def test_proposal_of_upf_is_a_kalman_filter_and_its_weights_undo_it() -> None:
    """A linear measurement: weighed by the match, 20,000 particles of one last state have the Kalman filter's mean and
    covariance."""
    upf, count = UPF(measurement_sd=1.5, carried=True), 20_000
    model, z, last = white_acceleration_model(1.0), np.array([2.0, -1.0]), np.array([0.0, 0.0, 1.0, 0.5])
    expected = model.F @ last
    for wide in (1.0, 3.0):
        before = wide * model.Q
        spread = np.tile(before, (count, 1, 1))
        x, P, lw = upf.proposed(np.tile(expected, (count, 1)), spread, z, model, stream(1, "upf"))
        R = 1.5**2 * np.eye(2)
        center, covariance = kalman.update(expected, before, z, np.eye(2, 4), R)
        np.testing.assert_allclose(P[0], covariance, rtol=1e-9)
        np.testing.assert_allclose(x.mean(axis=0), center, atol=5 * np.sqrt(covariance.max() / count))
        W = Weights(lw - 0.5 * ((x[:, :2] - z) ** 2).sum(axis=1) / 1.5**2).W
        center, covariance = kalman.update(expected, model.Q, z, np.eye(2, 4), R)
        np.testing.assert_allclose(W @ x, center, atol=0.05)
        np.testing.assert_allclose((x - center).T * W @ (x - center), covariance, atol=0.06)


def first_steps(tracker: LikelihoodPF, scene: Scene) -> tuple[Any, Frame]:
    """Return the state after three frames, and the next frame."""
    frames = [frame for frame, _ in scene]
    state = tracker.init(frames[0], Box(*scene[0][1], 14, 10), stream(0, 0))
    for k in range(1, 4):
        state, _ = tracker.step(state, frames[k], stream(0, k))
    return state, frames[4]


@pytest.mark.parametrize("sampling", ["one", "two"])
def test_likelihood_filter_has_the_posterior_mean(sampling: str) -> None:
    """One step of 1,000 particles against the sum over a lattice of .25 px, and a larger weight scatter than a filter
    that draws from the prior."""
    tracker = LikelihoodPF(particles=1000, radius=6.0, sampling=sampling)  # type: ignore[arg-type]  # one of the two
    state, frame = first_steps(tracker, blob(3, count=6))
    _, estimate = tracker.step(state, frame, stream(0, 4))
    steps = 0.25 * np.arange(-40, 41)
    x, y = np.meshgrid(state.center[0] + steps, state.center[1] + steps)
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    picture = state.appearance.view(frame)
    scale = 1 / (2 * tracker.sigma_grey**2)
    rho = state.appearance.likelihood(picture, places, state.reference, scale).lw
    picked = state.positions[stream(9, 9).choice(1000, 1000, p=state.weights)]
    posterior = np.exp(scale * (rho - rho.max())) * random_walk_density(places, picked, tracker.radius, "gaussian")
    center = posterior @ places / posterior.sum()
    np.testing.assert_allclose(estimate.center, center, atol=0.3)


def test_regression_smooths_weights_over_place() -> None:
    """Weights of a normal with one outlier of ten times the weight far off: copies are drawn about the mode, apart from
    one another."""
    rng = stream(5, "places")
    positions = rng.standard_normal((200, 2)) * 4
    W = np.exp(-0.5 * (positions**2).sum(axis=1) / 4)
    positions[0], W[0] = (9.0, 9.0), 0.3
    W /= W.sum()
    copies = positions[rng.choice(200, 200, p=W)]
    found = LikelihoodPF(particles=200, regressed=True).regressed_places(positions, W, copies, rng)
    assert len(np.unique(found, axis=0)) > 1.3 * len(np.unique(copies, axis=0))
    assert np.hypot(*found.mean(axis=0)) < 0.6
    assert found.std(axis=0).max() < 2.7


def jumping(seed: int, px: int) -> Scene:
    """A target that jumps by some columns in frame 20."""
    scene = blob(seed, count=32)
    return [
        (Frame(np.roll(frame.image, px * (k >= 20), axis=1), k, frame.time, frame.bits), (x + px * (k >= 20), y))
        for k, (frame, (x, y)) in enumerate(scene)
    ]


def test_second_group_recovers_from_a_jump() -> None:
    """Frames until the error is below 5 px again, with a noise that does not widen; before the jump both are alike."""
    waits, before = [], []
    for groups in ("one", "two"):
        row, errors = [], []
        for seed in range(6):
            scene = jumping(seed, 18)
            tracker = make("grey_pf", {"noise": "fixed", "r0": 1.0, "groups": groups})
            found = follow(tracker, [frame for frame, _ in scene], Box(*scene[0][1], 14, 10), seed)
            off = np.hypot(*np.subtract([each.center for each in found], [at for _, at in scene[1:]]).T)
            row.append(int(np.argmax(off[19:] < 5)) if (off[19:] < 5).any() else 12)
            errors.append(off[5:19].mean())
        waits.append(np.mean(row))
        before.append(np.mean(errors))
    assert waits[1] < waits[0] - 1
    assert before[1] < 1.3 * before[0]


def test_shares_of_groups_follow_their_evidence() -> None:
    """50 particles each; the second group's mean weight is three times the first's: its share becomes 3/4."""
    tracker = GreyPF(groups="two")
    W = np.repeat([0.25 / 50, 0.75 / 50], 50)
    assert tracker.wide_share(W, 0.5) == pytest.approx(0.75)
    assert tracker.wide_share(np.repeat([1 / 50, 0.0], 50), 0.5) == tracker.wide_least
