"""The figures against hand-worked cases, independent implementations and properties."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.types import Floats
from irtrack.metrics import (
    ATTRIBUTES,
    LOSS_RULE,
    PRECISION_NORM,
    PRECISION_PX,
    SUCCESS,
    Reference,
    area,
    centre_errors,
    loss,
    mean_abs,
    normalised_errors,
    off_frames,
    overlaps,
    precision_curve,
    rmse,
    score,
    success_curve,
    widened,
)
from irtrack.types import Estimate, Track


def track_of(centers: Floats, sizes: Floats, first: int = 0) -> Track:
    n = len(centers)
    estimates = tuple(Estimate(tuple(c), tuple(s)) for c, s in zip(centers.tolist(), sizes.tolist(), strict=True))
    return Track(
        source="s", source_hash="h", tracker="t", config={}, target="a", start=first, start_box=estimates[0].box,
        input="display", scene_seed=0, tracker_seed=0, indices=np.arange(first, first + n), times=np.arange(n) / 10,
        estimates=estimates, step_ms=np.array([100.0] + [1.0] * (n - 1)), cpu_ms=np.array([90.0] + [0.5] * (n - 1)),
    )  # fmt: skip


def reference_of(centers: Floats, sizes: Floats, visible: Floats | None = None, accuracy: float = 0.0) -> Reference:
    n = len(centers)
    unmarked = np.zeros((n, len(ATTRIBUTES)), bool)
    shown = np.ones(n) if visible is None else np.asarray(visible, dtype=float)
    return Reference(
        np.arange(n), np.asarray(centers, float), np.asarray(sizes, float), shown, np.full(n, accuracy), unmarked
    )


def pixels(n: int) -> st.SearchStrategy[Floats]:
    point = st.tuples(st.integers(-400, 400), st.integers(-400, 400))
    return st.lists(point, min_size=n, max_size=n).map(lambda rows: np.array(rows, dtype=float) / 4)


# -- centre error


def test_centre_error_by_hand() -> None:
    offsets = np.array([[3.0, 4.0], [-3.0, 0.0], [0.0, -1.0]])
    truth = np.array([[7.0, 7.0], [1.0, 2.0], [0.0, 0.0]])
    assert centre_errors(truth + offsets, truth).tolist() == [5.0, 3.0, 1.0]
    # |x| = 3, 3, 0: mean 2, variance ((1)^2 + 1^2 + 2^2) / 3 = 2
    assert mean_abs(offsets[:, 0]) == pytest.approx((2.0, math.sqrt(2.0)))
    assert rmse(offsets[:, 1]) == pytest.approx(math.sqrt(17 / 3))


def test_normalised_error_divides_each_axis_by_the_true_side() -> None:
    truth, sizes = np.array([[0.0, 0.0]]), np.array([[10.0, 40.0]])
    assert normalised_errors(np.array([[3.0, 16.0]]), truth, sizes)[0] == pytest.approx(0.5)  # hypot(.3, .4)


def test_precision_counts_errors_up_to_and_at_the_threshold() -> None:
    curve = precision_curve(np.array([0.0, 5.0, 5.5, 60.0]))
    assert len(PRECISION_PX) == 51
    assert curve[[0, 4, 5, 6, 50]].tolist() == [0.25, 0.25, 0.5, 0.75, 0.75]


def test_truth_of_limited_accuracy_scores_nothing_tighter() -> None:
    errors = np.array([0.9, 1.1])
    curve = precision_curve(errors, within_accuracy=errors <= 1.0)
    assert curve[:3].tolist() == [0.5, 0.5, 1.0]
    # 1.1 px is beyond an accuracy of 1 px; 40 px is within one of 50 and so never off
    assert off_frames(np.array([40.0, 40.0]), np.array([3.0, 3.0]), np.array([50.0, 1.0])).tolist() == [False, True]


def test_the_printed_rule_of_the_loss_names_all_that_decides_it() -> None:
    for words in ("largest of 5 px", "diagonal", "accuracy", "10 frames", "50% of the target is visible"):
        assert words in LOSS_RULE


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 12).flatmap(lambda n: st.tuples(pixels(n), pixels(n))))
def test_precision_curve_equals_a_count_by_loops(pair: tuple[Floats, Floats]) -> None:
    centers, truth = pair
    expected = []
    for threshold in range(51):
        right = 0
        for (x, y), (a, b) in zip(centers.tolist(), truth.tolist(), strict=True):
            if math.sqrt((x - a) ** 2 + (y - b) ** 2) <= threshold:
                right += 1
        expected.append(right / len(centers))
    assert precision_curve(centre_errors(centers, truth)).tolist() == expected


# -- overlap


def test_overlap_by_hand() -> None:
    # two 4x4 boxes shifted by (2, 0): common 2x4 = 8, union 16 + 16 - 8 = 24
    centers, sizes = np.array([[2.0, 0.0], [9.0, 0.0], [0.0, 0.0]]), np.array([[4.0, 4.0]] * 3)
    truth, truth_sizes = np.zeros((3, 2)), np.array([[4.0, 4.0], [4.0, 4.0], [2.0, 2.0]])
    assert overlaps(centers, sizes, truth, truth_sizes).tolist() == pytest.approx([1 / 3, 0.0, 0.25])


@settings(max_examples=50, deadline=None)
@given(pixels(2), st.tuples(*[st.integers(1, 60)] * 4))
def test_overlap_equals_a_count_of_cells(centers: Floats, sides: tuple[int, int, int, int]) -> None:
    """On a grid of 1/8 px the boxes (centres in quarters, sides in quarters) are unions of whole cells."""
    a, b = np.round(centers * 8).astype(int)
    boxes = []
    for (cx, cy), (w, h) in ((a, sides[:2]), (b, sides[2:])):
        boxes.append({(x, y) for x in range(cx - w, cx + w) for y in range(cy - h, cy + h)})
    expected = len(boxes[0] & boxes[1]) / len(boxes[0] | boxes[1])
    sizes = np.array(sides, dtype=float).reshape(2, 2) / 4
    assert overlaps(centers[:1], sizes[:1], centers[1:], sizes[1:])[0] == pytest.approx(expected)


def test_success_curve_and_its_area_by_hand() -> None:
    assert SUCCESS.tolist() == pytest.approx([i * 0.05 for i in range(21)])
    # overlap .5 is above the ten thresholds 0 .. .45, 0 is above none
    curve = success_curve(np.array([0.5, 0.0]))
    assert curve.tolist() == [0.5] * 10 + [0.0] * 11
    assert area(curve) == pytest.approx(10 * 0.5 / 21)


def test_a_perfect_overlap_scores_20_of_21() -> None:
    assert area(success_curve(np.ones(7))) == pytest.approx(20 / 21)


# -- loss


def test_a_frame_is_off_beyond_5_px_or_the_diagonal() -> None:
    errors = np.array([5.0, 5.001, 12.0, 13.5, np.nan])
    diagonals = np.array([3.0, 3.0, 13.0, 13.0, 13.0])
    assert off_frames(errors, diagonals, np.zeros(5)).tolist() == [False, True, False, True, False]


def test_nine_frames_off_are_no_loss_and_ten_are_dated_to_the_first() -> None:
    shown = np.ones(30, dtype=bool)
    off = np.zeros(30, dtype=bool)
    off[5:14] = True
    assert loss(off, shown) is None
    off[14] = True
    assert loss(off, shown) == 5


def test_hidden_frames_neither_count_nor_break_the_row() -> None:
    off = np.zeros(40, dtype=bool)
    off[5:20] = True
    shown = np.ones(40, dtype=bool)
    shown[8:14] = False  # 15 off, 6 of them hidden: 9 count
    assert loss(off, shown) is None
    off[20] = True
    assert loss(off, shown) == 5
    off[10] = False  # a hidden frame on target does not break the row
    assert loss(off, shown) == 5
    off[6] = False  # a shown one does: 7, 14..20 are 8 in a row
    assert loss(off, shown) is None


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
def test_loss_is_found_by_reading_and_only_comes_earlier_with_more_frames_off(rows: list[tuple[bool, bool]]) -> None:
    off, shown = np.array(rows).T
    kept = [position for position, (_, is_shown) in enumerate(rows) if is_shown]
    text = "".join("x" if rows[position][0] else "." for position in kept)
    found = text.find("x" * 10)
    assert loss(off, shown) == (None if found < 0 else kept[found])
    worse = off.copy()
    worse[len(rows) // 2 :] = True
    before, after = loss(off, shown), loss(worse, shown)
    assert before is None or (after is not None and after <= before)


# -- score


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


def test_the_start_frame_is_not_scored() -> None:
    truth, sizes = np.zeros((4, 2)), np.full((4, 2), 6.0)
    centers = truth.copy()
    centers[0] = 99.0
    assert score(track_of(centers, sizes), reference_of(truth, sizes)).all.error == 0


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


@settings(max_examples=50, deadline=None)
@given(pixels(15), pixels(15), st.integers(-50, 50), st.integers(-50, 50))
def test_shifting_track_and_truth_changes_nothing(centers: Floats, truth: Floats, dx: int, dy: int) -> None:
    sizes = np.full((15, 2), 6.0)
    here = score(track_of(centers, sizes), reference_of(truth, sizes))
    shift = np.array([dx, dy])
    there = score(track_of(centers + shift, sizes), reference_of(truth + shift, sizes))
    assert here == there  # quarters of a pixel add exactly


@settings(max_examples=50, deadline=None)
@given(pixels(15), pixels(15), st.integers(2, 9))
def test_twice_as_far_is_never_better(centers: Floats, truth: Floats, factor: int) -> None:
    sizes = np.full((15, 2), 6.0)
    near = score(track_of(centers, sizes), reference_of(truth, sizes))
    far = score(track_of(truth + factor * (centers - truth), sizes), reference_of(truth, sizes))
    assert far.all.rmse == pytest.approx(factor * (near.all.rmse or 0))
    for name in ("precision_5", "precision_20", "precision_norm", "success_auc"):
        assert getattr(far, name) <= getattr(near, name)
    assert far.lost or not near.lost
    assert (near.lost_at or 99) >= (far.lost_at or 99)


def test_nothing_tells_nothing() -> None:
    assert np.isnan(precision_curve(np.array([]), PRECISION_NORM)).all()
    assert np.isnan(success_curve(np.array([]))).all()
    assert np.isnan(rmse(np.array([])))
