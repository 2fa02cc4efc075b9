"""`imm_mf`: extent of a start, fit of a point, split hypotheses, and a target hidden behind a bar."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_scenes import follow, hiding

from irsim.types import Box
from irtrack.features.extent import extent
from irtrack.features.point_fit import fit_point, fitted_width
from irtrack.filters.multiple_model import MultipleModel, constant_velocity_model
from irtrack.filters.track_splitting import Hypotheses, Scores, Splitting
from irtrack.registry.table import make

BANK = MultipleModel.of([constant_velocity_model(0.2, 4)], 1.0)
RULES = Splitting(np.eye(2), 0.9, 1e-3, 16.0, 5, 4.0, 1.0)
SCORES = Scores(0.2, 0.25, 0.2)


def point(x: float, y: float, width: float, noise: float = 0.0) -> np.ndarray:
    """A point of 500 counts in a picture of 41 x 41 px, by sums over a fine grid."""
    fine = (np.arange(41 * 20) + 0.5) / 20 - 0.5
    across, down = (np.exp(-0.5 * ((fine - at) / width) ** 2).reshape(41, 20).sum(axis=1) for at in (x, y))
    picture = 500 * np.outer(down / down.sum(), across / across.sum()) + 100
    return (picture + noise * np.random.default_rng(0).standard_normal(picture.shape)).astype(np.float32)


def test_a_point_is_fitted_without_bias() -> None:
    picture = point(20.3, 19.8, 0.7)
    fit = fit_point(picture, (20.0, 20.0), 0.7)
    assert fit is not None
    assert fit.center == pytest.approx((20.3, 19.8), abs=0.002)
    assert fit.amplitude == pytest.approx(500, rel=0.01)
    assert fitted_width(picture, (20.3, 19.8)) == 0.7


def test_no_point_is_fitted_at_the_edge_or_on_flat_ground() -> None:
    assert fit_point(point(20, 20, 0.7), (1.0, 20.0), 0.7) is None
    assert fit_point(np.full((41, 41), 7, np.float32), (20.0, 20.0), 0.7) is None


@pytest.mark.parametrize("sign", [1, -1], ids=["hot", "cold"])
def test_a_small_thing_is_found_in_a_loose_box(sign: int) -> None:
    picture = np.full((60, 60), 100, np.float32)
    picture[28:31, 30:34] += sign * 50
    found = extent(picture, Box(30.0, 30.5, 18, 15))
    assert found.is_compact
    assert found.center == pytest.approx((31.5, 29.0), abs=0.3)
    assert not extent(picture, Box(31.5, 29.0, 4, 3)).is_compact


def stepped(before: Hypotheses, *detections: tuple[float, float]) -> Hypotheses:
    centers = np.array(detections, dtype=float).reshape(-1, 2)
    count = len(centers)
    noises = np.broadcast_to(np.eye(2), (count, 2, 2))
    return RULES.advance(before.predicted(BANK, (0.0, 0.0)), BANK, centers, np.ones(count), noises, 1.0, SCORES)


def test_two_like_detections_split_the_track_and_the_next_ones_decide() -> None:
    state = Hypotheses.started(BANK, (0.0, 0.0), 0.5, 1.0)
    state = stepped(state, (2.0, 0.0), (-2.0, 0.0))
    assert {int(each) for each in state.detection} >= {0, 1}
    state = stepped(stepped(state, (4.0, 0.0)), (6.0, 0.0))
    assert state.states.moments()[0][0, 0] > 4
    assert state.misses[0] == 0


def test_a_hidden_target_coasts_with_growing_covariance() -> None:
    state = Hypotheses.started(BANK, (0.0, 0.0), 0.5, 1.0)
    for k in range(1, 8):
        state = stepped(state, (float(k), 0.0))
    seen = state.states.moments()[1][0, 0, 0]
    for _ in range(10):
        state = stepped(state)
    assert state.misses[0] == 10
    assert state.states.moments()[0][0, 0] == pytest.approx(17, abs=1)
    assert state.states.moments()[1][0, 0, 0] > 10 * seen


def test_a_detection_of_an_older_object_is_not_the_targets() -> None:
    """The other stands still 9 px off the target's path; the target vanishes before it gets there."""
    state = Hypotheses.started(BANK, (0.0, 0.0), 0.5, 1.0)
    for k in range(1, 9):
        state = stepped(state, (float(k), 0.0), (14.0, 1.0))
    for _ in range(6):
        state = stepped(state, (14.0, 1.0))
    assert state.misses[0] == 6


def test_the_target_is_found_again_after_occlusion() -> None:
    frames, at, seen = hiding(0)
    estimates = follow(make("imm_mf"), frames, Box(float(at[0][0]), float(at[0][1]), 9, 9))
    errors = np.hypot(*(np.array([e.center for e in estimates]) - at[1:]).T)
    assert errors[np.array(seen[1:])].max() < 5
    hidden = [e.status for e, (x, _) in zip(estimates, at[1:], strict=True) if abs(x - 75) < 2]
    assert "tracking" not in hidden[1:]
    widest = max(estimates, key=lambda each: each.covariance[0, 0])  # type: ignore[index]
    assert widest.status != "tracking"
