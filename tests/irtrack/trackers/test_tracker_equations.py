"""The equations of the trackers, and their status, by hand."""

from __future__ import annotations

from math import exp, pi, sqrt
from typing import Any

import numpy as np
import pytest
from irtrack.filters.turn import coordinated_turn
from irtrack.trackers.ekf import EKF
from irtrack.trackers.grey import weigh
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.trackers.base import Sight
from irtrack.trackers.grey_pf import GreyPF
from irtrack.trackers.kalman import Kalman


def test_adaptive_noise_is_clipped_on_both_sides() -> None:
    """Cheng et al. 2006, eq. 12, with R0 = 10: .01 -> .1 -> Rmin; .3 -> 3; .9 -> 9 -> Rmax."""
    distances = np.array([0.01, 0.3, 0.9])
    assert GreyPF(r_min=0.5, r_max=5.0).deviation(distances, (14, 10)) == pytest.approx([0.5, 3, 5])
    assert GreyPF().deviation(distances, (14, 10)) == pytest.approx([0.5, 3, sqrt(140) / 2])
    assert GreyPF(noise="fixed", r0=2.0).deviation(distances, (14, 10)).tolist() == [2, 2, 2]


def test_the_ring_is_as_wide_as_asked() -> None:
    """A window of 9x7 px: half a side is 5 and 4 px on each side, a whole one 9 and 7."""
    frame, box = Frame(np.zeros((60, 80), np.uint8), 0, 0.0, 8), Box(40, 30, 9, 7)
    for ring, shape in ((0.5, (19, 15)), (1.0, (27, 21))):
        outer = GreyPF(ring=ring).init(frame, box, stream(0)).appearance.surround.outer
        assert (outer.columns, outer.rows) == shape


def test_weights_by_hand() -> None:
    """Cheng et al. 2006, eq. 10, lambda = 20: rho = .9, .7 give exp(-1), exp(-3)."""
    weights, in_view = weigh(np.array([0.9, 0.7, 0.0]), np.array([1.0, 0.5, 0.0]), 10.0)
    assert in_view
    assert weights == pytest.approx([exp(-1) / (exp(-1) + exp(-3)), exp(-3) / (exp(-1) + exp(-3)), 0])
    weights, _ = weigh(np.array([0.9, 0.7]), np.ones(2), 1e9)
    assert weights.tolist() == [1, 0]
    weights, in_view = weigh(np.zeros(4), np.zeros(4), 20.0)
    assert not in_view
    assert weights.tolist() == [0.25] * 4


def test_grey_pf_with_all_particles_outside_is_lost() -> None:
    scene = blob(0, count=2)
    tracker = GreyPF()
    state = tracker.init(scene[0][0], Box(*scene[0][1], 14, 10), stream(0, 0))
    fields = {name: getattr(state, name) for name in type(state).__slots__}
    away = {**fields, "positions": state.positions + 500, "previous": state.previous + 500}
    _, estimate = tracker.step(type(state)(**away), scene[1][0], stream(0, 1))
    assert estimate.status == "lost"
    assert estimate.neff == pytest.approx(100)


def test_grey_pf_updates_its_reference_by_eq_13_only_when_trusted() -> None:
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


def test_sight_by_hand() -> None:
    sight = Sight().after(0.8, 0.4, 0.5)
    assert (sight.level, sight.missed) == (0.8, 0)
    # The threshold is .4 + .5 (.8 - .4) = .6; seen, the level moves by a tenth of the way.
    assert sight.after(0.61, 0.4, 0.5).level == pytest.approx(0.8 - 0.019)
    hidden = sight.after(0.59, 0.4, 0.5).after(0.1, 0.4, 0.5)
    assert (hidden.level, hidden.missed) == (0.8, 2)
    assert [hidden.status(lost_after) for lost_after in (2, 3)] == ["lost", "occluded"]
    assert hidden.after(0.7, 0.4, 0.5).status(2) == "tracking"
    # What is no better than its surroundings is not seen, whatever it was before.
    assert sight.after(0.8, 0.9, 0.5).missed == 1
    assert Sight().after(1.0, 1.0, 0.5).missed == 1


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


def test_a_coordinated_turn_by_hand() -> None:
    """A quarter turn in one frame at speed pi / 2: along a circle of radius 1, from +x to +y."""
    moved, _ = coordinated_turn(np.array([3.0, 4.0, pi / 2, 0.0, pi / 2]))
    assert moved == pytest.approx([4, 5, 0, pi / 2, pi / 2])
    moved, _ = coordinated_turn(np.array([3.0, 4.0, 2.0, -1.0, 0.0]))
    assert moved == pytest.approx([5, 3, 2, -1, 0])


@pytest.mark.parametrize("rate", [0.0, 5e-5, -9.9e-5, 1.1e-4, 0.3, -1.2])
def test_the_jacobian_of_a_turn_is_its_derivative(rate: float) -> None:
    state = np.array([3.0, 4.0, 2.0, -1.0, rate])
    _, jacobian = coordinated_turn(state)
    step = 1e-5
    for i in range(5):
        up, down = (coordinated_turn(state + sign * step * np.eye(5)[i])[0] for sign in (1, -1))
        assert jacobian[:, i] == pytest.approx((up - down) / (2 * step), abs=1e-6)


def test_the_turn_filter_foresees_a_turn() -> None:
    """On a circle of radius 20 px at 0.15 rad/frame, hidden for 4 frames: the turn goes on, no line does."""
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
