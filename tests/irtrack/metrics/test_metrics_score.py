"""The score of a whole track, by hand and by invariance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tracks_by_hand import reference_of, track_of

from irtrack.metrics import score, widened


def test_a_perfect_track() -> None:
    centers, sizes = np.column_stack([np.arange(12.0), np.zeros(12)]), np.full((12, 2), 6.0)
    figures = score(track_of(centers, sizes), reference_of(centers, sizes))
    assert (figures.frames, figures.held_frames, figures.lost, figures.lost_at) == (11, 11, False, None)
    assert figures.all.error == figures.all.rmse == figures.all.abs_x == figures.all.sd_y == figures.off_share == 0
    assert figures.precision_5 == figures.precision_20 == figures.precision_norm == 1
    assert figures.success_auc == pytest.approx(20 / 21)
    assert figures.ms_mean == figures.ms_median == 1.0  # the start's 100 ms are not a step
    assert figures.cpu_ms_mean == figures.cpu_ms_median == 0.5


def test_a_perfect_track_of_a_point_target_scores_as_any_other() -> None:
    """Truth boxes of 1.58 px; the tracker keeps its start box, widened to 5 px, or says the true size."""
    truth, sizes = np.column_stack([np.arange(12.0), np.zeros(12)]), np.full((12, 2), 1.58)
    for said in (np.full((12, 2), 5.0), sizes):
        figures = score(track_of(truth, said), reference_of(truth, sizes))
        assert figures.success_auc == pytest.approx(20 / 21)
    # 2 px beside it: 5x5 boxes share 3x5 of 35, 3/7 is above 0 .. .4; 2/5 is within .40 .. .50
    beside = score(track_of(truth + np.array([2.0, 0.0]), sizes), reference_of(truth, sizes))
    assert beside.success_auc == pytest.approx(9 / 21)
    assert beside.precision_norm == pytest.approx(11 / 51)
    # a side that is long stays what it is
    assert widened(np.array([[2.0, 9.0], [np.nan, np.nan]])).tolist()[0] == [5.0, 9.0]


def test_a_track_that_loses_by_hand() -> None:
    """Frames 0..30; off by (3, 4) px up to frame 15, by (30, 40) from 16 on; 6x8 truth, diagonal 10."""
    truth, sizes = np.zeros((31, 2)), np.tile([6.0, 8.0], (31, 1))
    centers = np.where(np.arange(31)[:, None] < 16, [3.0, 4.0], [30.0, 40.0])
    figures = score(track_of(centers, sizes), reference_of(truth, sizes))
    assert (figures.frames, figures.held_frames, figures.lost, figures.lost_at) == (30, 15, True, 16)
    assert figures.off_share == 0.5
    assert figures.all.error == pytest.approx((15 * 5 + 15 * 50) / 30)
    assert (figures.held.error, figures.held.abs_x, figures.held.abs_y) == (5.0, 3.0, 4.0)
    assert (figures.held.sd_x, figures.held.rmse, figures.held.rmse_x, figures.held.rmse_y) == (0.0, 5.0, 3.0, 4.0)
    assert figures.all.abs_x == pytest.approx(16.5)
    assert figures.all.sd_x == pytest.approx(13.5)
    assert figures.all.rmse == pytest.approx(math.sqrt((25 + 2500) / 2))
    assert figures.precision_5 == figures.precision_20 == 0.5
    # normalised error hypot(3/6, 4/8) = .7071 is beyond 0.5
    assert figures.precision_norm == 0.0
    # boxes shifted by half their sides: 3 * 4 = 12 of 48 + 48 - 12, 1/7 is above 0, .05 and .1
    assert figures.success_auc == pytest.approx(0.5 * 3 / 21)


def test_absent_frames_are_left_out_and_hidden_ones_are_scored() -> None:
    truth, sizes = np.zeros((6, 2)), np.full((6, 2), 6.0)
    truth[2] = np.nan
    centers = np.zeros((6, 2))
    centers[2] = 50.0  # absent
    centers[3] = 8.0  # hidden
    visible = np.array([1.0, 1.0, np.nan, 0.0, np.nan, 1.0])
    figures = score(track_of(centers, sizes), reference_of(truth, sizes, visible))
    assert figures.frames == 4
    assert figures.all.error == pytest.approx(math.hypot(8, 8) / 4)
    assert figures.off_share == 0  # the hidden frame does not count; unknown visibility counts as visible
    lone = score(track_of(centers, sizes), reference_of(np.full((6, 2), np.nan), sizes))
    assert (lone.frames, lone.lost, lone.all.error, lone.success_auc, lone.ms_median) == (0, None, None, None, 1.0)


def test_accuracy_of_the_truth_enters_precision() -> None:
    truth, sizes = np.zeros((3, 2)), np.full((3, 2), 6.0)
    centers = np.array([[0.0, 0.0], [7.0, 0.0], [9.0, 0.0]])
    assert score(track_of(centers, sizes), reference_of(truth, sizes)).precision_5 == 0
    assert score(track_of(centers, sizes), reference_of(truth, sizes, accuracy=8.0)).precision_5 == 0.5
    assert score(track_of(centers, sizes), reference_of(truth, sizes, accuracy=8.0)).off_share == 0.5


def test_a_track_and_its_truth_meet_by_frame_index() -> None:
    truth = reference_of(np.column_stack([np.arange(9.0), np.zeros(9)]), np.full((9, 2), 6.0))
    late = track_of(
        np.array([[5.0, 0.0], [6.0, 0.0], [7.0, 0.0], [8.0, 0.0], [9.0, 0.0]]), np.full((5, 2), 6.0), first=5
    )
    figures = score(late, truth)
    assert figures.frames == 3  # frame 9 has no truth
    assert figures.all.error == 0


def test_a_score_is_made_of_plain_numbers() -> None:
    centers, sizes = np.full((9, 2), 9.0), np.full((9, 2), 6.0)
    found = score(track_of(centers, sizes), reference_of(centers + 1, sizes))
    assert "np." not in repr(found)
