"""The mean-shift trackers and the background-restrained filter: their equations by hand."""

from __future__ import annotations

from math import exp, pi

import numpy as np
import pytest
from irtrack.trackers.background_restrained_pf import BackgroundRestrainedPF
from irtrack.trackers.mean_shift_pf import MeanShiftPF
from tracker_scenes import blob, follow

from irsim.types import Box
from irtrack.filters.motion import random_walk_density
from irtrack.registry.table import make

WEIGHTS = np.array([0.1, 0.4, 0.05, 0.3, 0.15])


def test_restrained_weights_by_hand() -> None:
    kept = BackgroundRestrainedPF(keep=0.4).restrained(WEIGHTS)
    assert kept == pytest.approx([0, 4 / 7, 0, 3 / 7, 0])
    # By mass: .4 + .3 = .7 is not yet .8, with .15 it is passed.
    kept = BackgroundRestrainedPF(keep=0.8, keep_by="mass").restrained(WEIGHTS)
    assert kept == pytest.approx(np.array([0, 0.4, 0, 0.3, 0.15]) / 0.85)
    for keep_by in ("count", "mass"):
        assert BackgroundRestrainedPF(keep=0.0, keep_by=keep_by).restrained(WEIGHTS).tolist() == [0, 1, 0, 0, 0]
        assert BackgroundRestrainedPF(keep=1.0, keep_by=keep_by).restrained(WEIGHTS).tolist() == WEIGHTS.tolist()


def test_the_mean_is_drawn_by_a_false_target_and_the_restrained_mean_is_not() -> None:
    """An et al. 2007: sixty particles of mass .6 at 0, forty of mass .4 at 10 px: the mean is .4 . 10 off;
    the heaviest half all stand at 0."""
    places = np.array([0.0] * 60 + [10.0] * 40)
    weights = np.array([0.6 / 60 + 0.0001] * 60 + [0.4 / 40 - 0.00015] * 40)
    estimates = {}
    for estimate in ("mean", "restrained", "map"):
        tracker = BackgroundRestrainedPF(keep=0.5, estimate=estimate)
        estimates[estimate] = float(tracker.pointing(weights, tracker.restrained(weights)) @ places)
    assert estimates["mean"] == pytest.approx(0.394 * 10)
    assert (estimates["restrained"], estimates["map"]) == (0, 0)


def test_keeping_all_is_grey_pf() -> None:
    scene = blob(3, count=10)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    plain = follow(make("grey_pf"), frames, box)
    for keep_by in ("count", "mass"):
        kept = follow(make("background_restrained_pf", {"keep": 1.0, "keep_by": keep_by}), frames, box)
        assert [e.center for e in kept] == [e.center for e in plain]


def test_density_of_a_walk_by_hand() -> None:
    """Origins at 0 and 6 px, radius 9 px, a place at 3 and one at 12: normal of deviation 3, or a disc."""
    places, origins = np.array([[3.0, 0.0], [12.0, 0.0]]), np.array([[0.0, 0.0], [6.0, 0.0]])
    normal = random_walk_density(places, origins, 9.0, "gaussian")
    assert normal == pytest.approx(np.array([exp(-0.5), (exp(-8) + exp(-2)) / 2]) / (2 * pi * 9))
    disc = random_walk_density(places, origins, 9.0, "disc")
    assert disc == pytest.approx(np.array([1, 0.5]) / (pi * 81))


def test_corrected_weights_make_up_for_the_climb() -> None:
    """Both origins at 0; both particles climbed to 2 px. Deviations: model 10 / 3 px, scatter 1 px."""
    places = np.array([[2.0, 0.0], [3.0, 0.0]])
    climbed, start = np.full((2, 2), [2.0, 0.0]), np.zeros((2, 2))
    weights = MeanShiftPF(corrected=True)._made_up_for(np.array([0.5, 0.5]), places, start, climbed)
    prior = np.exp(-(places[:, 0] ** 2) / (2 * (10 / 3) ** 2))
    ratio = prior / np.exp(-((places[:, 0] - 2) ** 2) / 2)
    assert weights == pytest.approx(ratio / ratio.sum())
    # What the disc cannot reach from any origin keeps its weight by likeness.
    far = MeanShiftPF(corrected=True, propagation="disc", radius=1.0)
    assert far._made_up_for(np.array([0.2, 0.8]), places, start, climbed).tolist() == [0.2, 0.8]


def test_mean_shift_kalman_waits_for_a_hidden_target_on_its_way() -> None:
    for seed in range(3):
        scene = blob(seed, count=34, hidden=range(20, 28), speed=2.0)
        frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
        waited = follow(make("mean_shift_kalman"), frames, box)
        assert np.hypot(*np.subtract(waited[-1].center, scene[-1][1])) < 2
        spread = [np.trace(e.covariance) for e in waited if e.covariance is not None]
        assert spread[26] > 4 * spread[18]
        assert waited[26].status == "occluded"
