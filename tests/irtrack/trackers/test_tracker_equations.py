"""The equations of the trackers, and their status, by hand."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
import pytest
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.filters.motion import Propagation, random_walk, random_walk_variance
from irtrack.registry.table import make
from irtrack.trackers.base import VisibilityMonitor
from irtrack.trackers.cascade_pf import CascadePF
from irtrack.trackers.grey_pf import BackgroundRestrainedPF, GreyPF
from irtrack.trackers.kalman import EKF, Kalman
from irtrack.trackers.mean_shift import MeanShiftPF
from irtrack.trackers.template import Template


def test_adaptive_noise_is_clipped_on_both_sides() -> None:
    """Cheng et al. 2006, eq. 12, with R0 = 10: .01 -> .1 -> Rmin; .3 -> 3; .9 -> 9 -> Rmax."""
    distances = np.array([0.01, 0.3, 0.9])
    assert GreyPF(r_min=0.5, r_max=5.0).deviation(distances, (14, 10)) == pytest.approx([0.5, 3, 5])
    assert GreyPF().deviation(distances, (14, 10)) == pytest.approx([0.5, 3, sqrt(140) / 2])
    assert GreyPF(noise="fixed", r0=2.0).deviation(distances, (14, 10)).tolist() == [2, 2, 2]


def test_grey_pf_with_all_particles_outside_is_lost() -> None:
    scene = blob(0, count=2)
    tracker = GreyPF()
    state = tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0))
    fields = {name: getattr(state, name) for name in type(state).__slots__}
    away = {**fields, "positions": state.positions + 500, "previous": state.previous + 500}
    _, estimate = tracker.step(type(state)(**away), scene[1][0], stream(0, 1))
    assert estimate.status == "lost"
    assert estimate.neff == pytest.approx(100)


def test_grey_pf_updates_its_reference_by_eq_13() -> None:
    scene = blob(0, count=2)
    box = Box(*scene[0][1], 14, 10)

    def change(**parameters: Any) -> float:
        tracker = GreyPF(**parameters)
        state = tracker.init(scene[0][0], box, stream(0, 0))
        after, _ = tracker.step(state, scene[1][0], stream(0, 1))
        assert after.reference.sum() == pytest.approx(1)
        return float(np.abs(after.reference - state.reference).sum())

    assert change(update=False) == 0
    assert change(w_t=1.0) == 0
    assert change(w_t=0.0, alpha=0.1) == pytest.approx(5 * change(w_t=0.0, alpha=0.02))
    assert change(w_t=0.0) == change() > 0


def test_visibility_monitor_by_hand() -> None:
    monitor = VisibilityMonitor().after(0.8, 0.4, 0.5)
    assert (monitor.level, monitor.misses) == (0.8, 0)
    # The threshold is .4 + .5 (.8 - .4) = .6; after a hit the level moves by a tenth of the way.
    assert monitor.after(0.61, 0.4, 0.5).level == pytest.approx(0.8 - 0.019)
    hidden = monitor.after(0.59, 0.4, 0.5).after(0.1, 0.4, 0.5)
    assert (hidden.level, hidden.misses) == (0.8, 2)
    assert [hidden.status(lost_after) for lost_after in (2, 3)] == ["lost", "occluded"]
    assert hidden.after(0.7, 0.4, 0.5).status(2) == "tracking"
    # A score no better than the background score is a miss, whatever the level.
    assert monitor.after(0.8, 0.9, 0.5).misses == 1
    assert VisibilityMonitor().after(1.0, 1.0, 0.5).misses == 1


def test_kalman_rejects_a_measurement_beyond_the_gate() -> None:
    """A second, equal blob appears 20 px away while the first is gone: the prediction stands."""
    scene = blob(2, count=30, speed=0.0)
    frames, (cx, cy) = [frame for frame, _ in scene], scene[0][1]
    for k in range(25, 30):
        image = np.roll(frames[k].image, 20, axis=1)
        frames[k] = Frame(image, k, k / 30, 8)
    estimates = follow(Kalman(), frames, Box(cx, cy, 14, 10))
    first = estimates[24]
    assert first.status == "occluded"
    assert np.hypot(*np.subtract(first.center, (cx, cy))) < 0.5
    assert first.covariance is not None
    assert estimates[23].covariance is not None
    assert np.trace(first.covariance) > np.trace(estimates[23].covariance)


def test_ekf_predicts_a_turn() -> None:
    """On a circle of radius 20 px at 0.15 rad/frame, hidden for the last 4 frames."""
    y, x = np.mgrid[:120, :160]
    noise = np.random.default_rng(4)
    frames, at = [], []
    for k in range(44):
        cx, cy = 80 + 20 * np.cos(0.15 * k), 60 + 20 * np.sin(0.15 * k)
        target = 80 * np.exp(-((x - cx) ** 2) / (2 * 3.5**2) - (y - cy) ** 2 / (2 * 2.5**2)) * (k < 40)
        image = np.clip(80 + target + 4 * noise.standard_normal(x.shape), 0, 255).astype(np.uint8)
        frames.append(Frame(image, k, k / 30, 8))
        at.append((cx, cy))
    errors = {}
    for tracker in (EKF(measurement="ncc"), Kalman(measurement="ncc")):
        last = follow(tracker, frames, Box(*at[0], 14, 10))[-1]
        errors[type(tracker)] = float(np.hypot(*np.subtract(last.center, at[-1])))
    assert errors[EKF] < 3
    # Straight on for 4 frames of 3 px from a circle of radius 20: off by some 12^2 / 40 = 3.6 px.
    assert errors[Kalman] > errors[EKF] + 1


WEIGHTS = np.array([0.1, 0.4, 0.05, 0.3, 0.15])


def test_truncated_weights_by_hand() -> None:
    kept = BackgroundRestrainedPF(keep=0.4).truncated_weights(WEIGHTS)
    assert kept == pytest.approx([0, 4 / 7, 0, 3 / 7, 0])
    # By mass: .4 + .3 = .7 is not yet .8, with .15 it is passed.
    kept = BackgroundRestrainedPF(keep=0.8, keep_by="mass").truncated_weights(WEIGHTS)
    assert kept == pytest.approx(np.array([0, 0.4, 0, 0.3, 0.15]) / 0.85)
    for keep_by in ("count", "mass"):
        assert BackgroundRestrainedPF(keep=0.0, keep_by=keep_by).truncated_weights(WEIGHTS).tolist() == [0, 1, 0, 0, 0]
        assert BackgroundRestrainedPF(keep=1.0, keep_by=keep_by).truncated_weights(WEIGHTS).tolist() == WEIGHTS.tolist()


def test_a_truncated_mean_ignores_a_false_target() -> None:
    """An et al. 2007: sixty particles of mass .6 at 0, forty of mass .4 at 10 px: the mean is .4 . 10 off;
    the heaviest half all stand at 0."""
    places = np.array([0.0] * 60 + [10.0] * 40)
    weights = np.array([0.6 / 60 + 0.0001] * 60 + [0.4 / 40 - 0.00015] * 40)
    estimates = {}
    for estimate in ("mean", "restrained", "map"):
        tracker = BackgroundRestrainedPF(keep=0.5, estimate=estimate)
        estimates[estimate] = float(tracker.estimator_weights(weights, tracker.truncated_weights(weights)) @ places)
    assert estimates["mean"] == pytest.approx(0.394 * 10)
    assert (estimates["restrained"], estimates["map"]) == (0, 0)


def test_covariance_and_neff_are_those_of_the_estimator() -> None:
    scene = blob(3, count=4)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    sizes = {}
    for estimate in ("mean", "restrained"):
        last = follow(make("background_restrained_pf", {"keep": 0.3, "estimate": estimate}), frames[:2], box)[-1]
        assert last.neff is not None
        assert last.covariance is not None
        sizes[estimate] = last.neff, float(np.trace(last.covariance))
    assert sizes["restrained"][0] <= 30 < sizes["mean"][0]
    assert sizes["restrained"][1] < sizes["mean"][1]


def test_keeping_all_is_grey_pf() -> None:
    scene = blob(3, count=10)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    plain = follow(make("grey_pf"), frames, box)
    for keep_by in ("count", "mass"):
        kept = follow(make("background_restrained_pf", {"keep": 1.0, "keep_by": keep_by}), frames, box)
        assert [e.center for e in kept] == [e.center for e in plain]


def test_importance_correction_by_hand() -> None:
    """Both origins at 0; both particles shifted to 2 px. Deviations: model 10 / 3 px, scatter 1 px."""
    places = np.array([[2.0, 0.0], [3.0, 0.0]])
    modes, start = np.full((2, 2), [2.0, 0.0]), np.zeros((2, 2))
    weights = MeanShiftPF(corrected=True).importance_correction(np.array([0.5, 0.5]), places, start, modes)
    prior = np.exp(-(places[:, 0] ** 2) / (2 * (10 / 3) ** 2))
    ratio = prior / np.exp(-((places[:, 0] - 2) ** 2) / 2)
    assert weights == pytest.approx(ratio / ratio.sum())
    # Places that the disc reaches from no origin keep their weight.
    far = MeanShiftPF(corrected=True, propagation="disc", radius=1.0)
    assert far.importance_correction(np.array([0.2, 0.8]), places, start, modes).tolist() == [0.2, 0.8]


def test_mean_shift_kalman_predicts_an_occluded_target() -> None:
    scene = blob(0, count=34, hidden=range(20, 28), speed=2.0)
    frames, box = [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)
    waited = follow(make("mean_shift_kalman"), frames, box)
    assert np.hypot(*np.subtract(waited[-1].center, scene[-1][1])) < 2
    spread = [np.trace(e.covariance) for e in waited if e.covariance is not None]
    assert spread[26] > 4 * spread[18]
    assert waited[26].status == "occluded"


@pytest.mark.parametrize(("window", "box"), [(None, Box(23.5, 42.5, 8.0, 6.0)), (6, Box(2.0, 2.0, 8.0, 6.0))])
def test_a_template_without_structure_stays(window: int | None, box: Box) -> None:
    """A saturated target that fills its box: all places have the same score."""
    image = np.random.default_rng(1).normal(60, 3, (64, 80)).clip(0, 255).astype(np.uint8)
    left, top, right, bottom = (round(edge + 0.5) for edge in box.edges)
    image[max(top, 0) : bottom, max(left, 0) : right] = 200
    tracker, rng = Template(window=window), np.random.default_rng(0)
    state = tracker.init(Frame(image, 0, 0.0, 8), box, rng)
    for index in range(1, 4):
        state, estimate = tracker.step(state, Frame(image, index, index / 30, 8), rng)
        assert estimate.center == pytest.approx((box.cx, box.cy), abs=0.01)


def test_correlation_patch_is_blended_by_its_rate() -> None:
    scene = blob(0, count=2)
    box = Box(*scene[0][1], 14, 10)

    def change(update: float) -> float:
        tracker = Kalman(measurement="ncc", update=update)
        state = tracker.init(scene[0][0], box, stream(0, 0))
        after, _ = tracker.step(state, scene[1][0], stream(0, 1))
        return float(np.abs(after.target.patch.pixels - state.target.patch.pixels).sum())

    assert change(0) == 0
    assert change(0.2) == pytest.approx(4 * change(0.05))
    assert change(0.05) > 0


def test_cascade_counts_distinct_places() -> None:
    """Two places of weight 1: 15 draws are at most 2 particles, and the covariance is at least s^2 / N1."""
    tracker = CascadePF(resampling="systematic")
    places, W = np.arange(60.0).reshape(30, 2), np.zeros(30)
    W[[3, 7]] = 0.6, 0.4
    chosen, weights = tracker._weighed_by_velocity(places, W, lambda at: np.zeros(len(at)), stream(0, 0))
    assert chosen.tolist() == places[[3, 7]].tolist()
    assert weights == pytest.approx([9 / 15, 6 / 15])
    scene = blob(0, count=12)
    for estimate in follow(tracker, [frame for frame, _ in scene], Box(*scene[0][1], 14, 10)):
        assert estimate.covariance is not None
        assert np.linalg.eigvalsh(estimate.covariance)[0] >= 0.999 * (10 / 3) ** 2 / 30


@pytest.mark.parametrize("propagation", ["gaussian", "disc"])
def test_variance_of_the_random_walk(propagation: Propagation) -> None:
    moved = random_walk(np.zeros((40_000, 2)), 6.0, propagation, stream(0, 0))
    assert moved.var(axis=0) == pytest.approx([random_walk_variance(6.0, propagation)] * 2, rel=0.03)


@pytest.mark.parametrize(("most", "expected"), [(4.0, 1.4**2), (1.5, 1.5)])
def test_number_of_particles_grows_with_speed(most: float, expected: float) -> None:
    """(1 + v / r)^2 at v = 4 px/frame, r = 10 px, and none at rest; the cascade gives its distinct particles alone."""
    for name, counts in (("cascade_pf", {"n1": 300, "n2": 150}), ("product_pf", {"particles": 45})):
        tracker = make(name, {"by_speed": True, "by_speed_most": most, "high_pass": "none", **counts})
        found = []
        for speed in (0.0, 4.0):
            scene = blob(1, count=7, speed=speed)
            state = tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0))
            state = replace(state, trajectory=np.array([at for _, at in scene[:5]]))
            state, estimate = tracker.step(state, scene[5][0], stream(0, 5))
            assert estimate.particles is not None
            found.append(len(estimate.particles))
        if name == "product_pf":
            assert found == pytest.approx([45, 45 * expected], abs=1)
        else:
            assert found[0] <= 150
            assert found[1] <= 150 * expected + 1
