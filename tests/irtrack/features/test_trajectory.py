"""Velocities from trajectories, and the particle filters that use them."""

from __future__ import annotations

from dataclasses import replace
from math import exp, sqrt

import numpy as np
import pytest
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Floats, Frame
from irtrack.features.trajectory import line_fit, pca_velocity, velocity_similarity
from irtrack.filters.motion import random_walk
from irtrack.trackers.cascade_pf import CascadePF, CoastingPF, ProductPF

FIVE = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [4.0, 4.0]])


def test_pca_of_five_points_by_hand() -> None:
    """Xue et al. 2011, Algorithm 1: C = ((2, 2), (2, 2)), lambda = 4, e = (1, 1) / sqrt 2."""
    assert pca_velocity(FIVE, "lambda") == pytest.approx(np.array([4, 4]) / sqrt(2))
    assert pca_velocity(FIVE, "sqrt_lambda") == pytest.approx(np.array([2, 2]) / sqrt(2))
    assert pca_velocity(FIVE[::-1], "lambda") == pytest.approx(-np.array([4, 4]) / sqrt(2))
    # x = 0 2 2 2 4, y = 0 1 0 -1 0: C = ((8/5, 0), (0, 2/5)): lambda = 1.6 along x.
    places = np.array([[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [2.0, -1.0], [4.0, 0.0]])
    assert pca_velocity(places, "lambda") == pytest.approx([1.6, 0])
    swapped = places[:, ::-1]
    assert pca_velocity(swapped, "lambda") == pytest.approx([0, 1.6])


def test_pca_is_that_of_a_general_eigensolver() -> None:
    tracks = np.random.default_rng(4).normal(0, 3, (10, 6, 2))
    for track, velocity in zip(tracks, pca_velocity(tracks, "lambda"), strict=True):
        values, vectors = np.linalg.eigh(np.cov(track.T, bias=True))
        axis = vectors[:, 1] * np.sign(vectors[:, 1] @ (track[-1] - track[0]))
        assert velocity == pytest.approx(values[1] * axis)
    # Places that coincide have none.
    assert pca_velocity(np.full((5, 2), 7.0), "lambda").tolist() == [0, 0]


def test_similarity_by_hand() -> None:
    """Eq. 6: speeds 5 and 10 along one way: 1/2; at right angles or backwards: 0; 60 degrees: half as much."""
    model = np.array([6.0, 8.0])
    aside = 5 * np.array([0.6 * 0.5 - 0.8 * sqrt(0.75), 0.8 * 0.5 + 0.6 * sqrt(0.75)])
    velocities = np.array([[3.0, 4.0], [6.0, 8.0], [12.0, 16.0], [-8.0, 6.0], [-6.0, -8.0], [0.0, 0.0], aside])
    assert velocity_similarity(velocities, model) == pytest.approx([0.5, 1, 0.5, 0, 0, 0, 0.25])
    assert velocity_similarity(np.zeros((1, 2)), np.zeros(2)).tolist() == [1]
    assert velocity_similarity(np.ones((1, 2)), np.zeros(2)).tolist() == [0]


def test_line_by_hand() -> None:
    """v = 12 / (5 . 24) (-2, -1, 0, 1, 2) . x; through 0 2 1 3 4 it is .9 px a frame, at 2 + 3 . .9 next."""
    places = np.array([[0.0, 5.0], [2.0, 5.0], [1.0, 5.0], [3.0, 5.0], [4.0, 5.0]])
    ahead, velocity = line_fit(places)
    assert velocity == pytest.approx([0.9, 0])
    assert ahead == pytest.approx([4.7, 5])
    ahead, velocity = line_fit(places[:1])
    assert (ahead.tolist(), velocity.tolist()) == ([0, 5], [0, 0])


@pytest.mark.parametrize(("propagation", "square"), [("disc", 10**2 / 4), ("gaussian", (10 / 3) ** 2)])
def test_random_walk_has_its_variance(propagation: str, square: float) -> None:
    """An even disc has R^2 / 4 on each axis and nothing beyond R."""
    places = random_walk(np.zeros((40000, 2)), 10.0, propagation, stream(1, "walk"))  # type: ignore[arg-type]  # one of the two words, to mypy any str
    assert (places**2).mean(axis=0) == pytest.approx([square, square], rel=0.03)
    if propagation == "disc":
        assert np.hypot(*places.T).max() <= 10


def test_cascade_and_product_of_cues_by_hand() -> None:
    positions = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    grey = np.array([0.0, 0.25, 0.75])

    def cue(places: Floats) -> Floats:
        return -places[:, 0]

    drawn, weights = CascadePF(n1=3, n2=4000)._weighed_by_velocity(positions, grey, cue, stream(2, "draw"))
    assert drawn.tolist() == [[1, 0], [2, 0]]  # copies of a particle are one, with the sum of their weights
    copies = weights / np.exp([-1.0, -2.0])
    assert copies[1] / copies.sum() == pytest.approx(0.75, abs=4 * sqrt(0.75 * 0.25 / 4000))
    same, weights = ProductPF()._weighed_by_velocity(positions, grey, cue, stream(2, "draw"))
    assert same is positions
    assert weights == pytest.approx(np.array([0, 0.25 * exp(-1), 0.75 * exp(-2)]) / (0.25 * exp(-1) + 0.75 * exp(-2)))


def test_cascade_prefers_the_place_on_its_course() -> None:
    """Eq. 7, sigma .5, k = 5: after 0 1 2 3 4 px, a place 5 px on has the model's own velocity; one that
    stays, or turns back, has less."""
    tracker = CascadePF()
    trajectory = np.stack([np.arange(5.0), np.zeros(5)], axis=1)
    frame, box = Frame(np.zeros((40, 40), np.uint8), 0, 0.0, 8), Box(4, 0, 5, 5)
    state = replace(tracker.init(frame, box, stream(0)), trajectory=trajectory)
    cue = tracker._velocity_cue(state, *line_fit(trajectory)[:1])
    onward, stays, back = cue(np.array([[5.0, 0.0], [4.0, 0.0], [0.0, 0.0]]))
    assert onward == pytest.approx(0)
    # 1 2 3 4 4: variance 1.36 beside 2: rho = .68.
    assert stays == pytest.approx((0.68 - 1) / (2 * 0.5**2))
    assert back == pytest.approx(-1 / (2 * 0.5**2))  # the last place lies behind the first: rho = 0


def test_first_frames_run_the_first_layer_alone() -> None:
    scene = blob(4, count=12)
    estimates = follow(CascadePF(), [frame for frame, _ in scene], Box(*scene[0][1], 14, 10))
    counts = [len(e.weights) for e in estimates if e.weights is not None]
    assert counts[:4] == [30] * 4
    assert 1 <= min(counts[4:]) <= max(counts[4:]) <= 15  # distinct ones


def test_coasting_predicts_an_occluded_target() -> None:
    """Ten hidden frames at 2 px a frame."""
    scene = blob(0, count=40, hidden=range(24, 34), speed=2.0)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    estimates = follow(CoastingPF(), frames, box)
    assert np.hypot(*np.subtract(estimates[32].center, scene[33][1])) < 6
    assert np.hypot(*np.subtract(estimates[-1].center, scene[-1][1])) < 2
    assert estimates[28].status == "occluded"
    hidden, seen = estimates[31].covariance, estimates[20].covariance
    assert hidden is not None
    assert seen is not None
    assert np.trace(hidden) > np.trace(seen)
