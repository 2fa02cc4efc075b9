"""Centre error, overlap and loss against hand-worked cases, independent implementations and properties."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irtrack.metrics import (
    PRECISION_PX,
    SUCCESS,
    area,
    centre_errors,
    loss,
    mean_abs,
    normalised_errors,
    off_frames,
    overlaps,
    precision_curve,
    rmse,
    success_curve,
)

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


def test_errors_within_the_accuracy() -> None:
    errors = np.array([0.9, 1.1])
    curve = precision_curve(errors, within_accuracy=errors <= 1.0)
    assert curve[:3].tolist() == [0.5, 0.5, 1.0]
    # 1.1 px is beyond an accuracy of 1 px; 40 px is within one of 50 and so never off
    assert off_frames(np.array([40.0, 40.0]), np.array([3.0, 3.0]), np.array([50.0, 1.0])).tolist() == [False, True]


# -- overlap


def test_overlap_by_hand() -> None:
    # two 4x4 boxes shifted by (2, 0): common 2x4 = 8, union 16 + 16 - 8 = 24
    centers, sizes = np.array([[2.0, 0.0], [9.0, 0.0], [0.0, 0.0]]), np.array([[4.0, 4.0]] * 3)
    truth, truth_sizes = np.zeros((3, 2)), np.array([[4.0, 4.0], [4.0, 4.0], [2.0, 2.0]])
    assert overlaps(centers, sizes, truth, truth_sizes).tolist() == pytest.approx([1 / 3, 0.0, 0.25])


def test_success_curve_and_its_area_by_hand() -> None:
    assert SUCCESS.tolist() == pytest.approx([i * 0.05 for i in range(21)])
    # overlap .5 is above the ten thresholds 0 .. .45, 0 is above none
    curve = success_curve(np.array([0.5, 0.0]))
    assert curve.tolist() == [0.5] * 10 + [0.0] * 11
    assert area(curve) == pytest.approx(10 * 0.5 / 21)


# -- loss


def test_a_frame_is_off_beyond_5_px_or_the_diagonal() -> None:
    errors = np.array([5.0, 5.001, 12.0, 13.5, np.nan])
    diagonals = np.array([3.0, 3.0, 13.0, 13.0, 13.0])
    assert off_frames(errors, diagonals, np.zeros(5)).tolist() == [False, True, False, True, False]


def test_ten_frames_off_in_a_row_are_a_loss() -> None:
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
def test_loss_by_search_and_monotonic_in_off_frames(rows: list[tuple[bool, bool]]) -> None:
    off, shown = np.array(rows).T
    kept = [position for position, (_, is_shown) in enumerate(rows) if is_shown]
    text = "".join("x" if rows[position][0] else "." for position in kept)
    found = text.find("x" * 10)
    assert loss(off, shown) == (None if found < 0 else kept[found])
    worse = off.copy()
    worse[len(rows) // 2 :] = True
    before, after = loss(off, shown), loss(worse, shown)
    assert before is None or (after is not None and after <= before)
