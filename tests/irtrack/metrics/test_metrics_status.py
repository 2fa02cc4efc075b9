"""Figures of occlusion, status, covariance and survival: hand-worked cases and independent implementations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from traces import trace_at

from irsim.types import Floats
from irtrack.metrics import (
    FIGURES,
    Return,
    Score,
    Trace,
    false_lost,
    false_tracking,
    hidden_tracking,
    kaplan_meier,
    long_term,
    lost_late,
    nees,
    nees_interval,
    returns,
    score_trace,
)


def bits(text: str) -> np.ndarray:
    """'101' is [True, False, True]."""
    return np.array([letter == "1" for letter in text])


def trace_of(offsets: Floats, statuses: list[str], visible: Floats) -> Trace:
    """Return a track with a covariance of 4 px² from frame 100 on."""
    n = len(offsets)
    return trace_at(
        offsets,
        indices=np.arange(100, 100 + n),
        statuses=np.array(statuses),
        neffs=np.linspace(10, 20, n),
        covariances=np.tile(4.0 * np.eye(2), (n, 1, 1)),
        visible=visible,
    )


# -- reappearance


def test_returns_by_hand() -> None:
    #        0123456789
    shown = "1100111011"
    off = "0011110001"
    assert returns(bits(off), bits(shown)) == [Return(4, 3, 2), Return(8, 2, 0)]
    assert returns(bits("1111"), bits("0110")) == [Return(1, 2, None)]
    assert returns(bits("000"), bits("111")) == returns(bits("000"), bits("000")) == []


# -- status


def test_status_calibration_by_hand() -> None:
    said = np.array(["tracking", "tracking", "occluded", "lost", "tracking", "lost"])
    off, counted = bits("011101"), bits("111110")
    assert false_tracking(said, off, counted) == pytest.approx(1 / 3)  # off: frames 1, 2, 3
    assert false_lost(said, off, counted) == 0.0  # on it: frames 0 and 4
    assert false_lost(np.full(2, "lost"), bits("00"), bits("11")) == 1.0
    assert hidden_tracking(said, bits("001011")) == pytest.approx(1 / 3)
    assert np.isnan(hidden_tracking(said, bits("000000")))
    assert np.isnan(false_tracking(said, bits("000000"), counted))
    assert lost_late(said, 1) == 2
    assert lost_late(said[:3], 1) == 2  # it never says so: at least the two frames left
    assert np.isnan(lost_late(said, None))


# -- covariance


def test_nees_agrees_with_the_solved_system_and_the_chi_square() -> None:
    rng = np.random.default_rng(3)
    roots = rng.normal(size=(5000, 2, 2))
    covariances = roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(2)
    offsets = np.einsum("nij,nj->ni", np.linalg.cholesky(covariances), rng.normal(size=(5000, 2)))
    found = nees(offsets, covariances)
    solved = np.einsum("ni,ni->n", offsets, np.linalg.solve(covariances, offsets[:, :, None])[:, :, 0])
    assert found == pytest.approx(solved, rel=1e-9)
    low, high = nees_interval(5000, 0.999)
    assert low < found.mean() < high
    assert stats.kstest(found, stats.chi2(2).cdf).pvalue > 1e-3


def test_nees_of_no_covariance_and_of_one_without_inverse() -> None:
    covariances = np.array([np.full((2, 2), np.nan), np.zeros((2, 2)), np.zeros((2, 2))])
    found = nees(np.array([[1.0, 1.0], [0.0, 0.0], [1.0, 0.0]]), covariances)
    assert np.isnan(found[0])
    assert found[1] == 0
    assert found[2] == np.inf


# -- survival


@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(st.integers(1, 12), st.booleans()), min_size=2, max_size=30))
def test_kaplan_meier_agrees_with_scipy(rows: list[tuple[int, bool]]) -> None:
    times, lost = np.array([row[0] for row in rows], float), np.array([row[1] for row in rows])
    if not lost.any():
        assert len(kaplan_meier(times, lost).times) == 0
        return
    found = kaplan_meier(times, lost)
    theirs = stats.ecdf(stats.CensoredData(uncensored=times[lost], right=times[~lost])).sf
    assert found.held == pytest.approx(theirs.evaluate(found.times))
    with np.errstate(all="ignore"):
        between = theirs.confidence_interval(0.95, method="log-log")
    inside = found.held > 0
    assert found.low[inside] == pytest.approx(between.low.evaluate(found.times)[inside])
    assert found.high[inside] == pytest.approx(between.high.evaluate(found.times)[inside])


@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(st.floats(0, 1), st.sampled_from([np.nan, 0.1, 0.5, 0.9]), st.booleans()), max_size=20))
def test_long_term_agrees_with_every_threshold_tried(rows: list[tuple[float, float, bool]]) -> None:
    overlap, confidence = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    present = np.array([row[2] for row in rows], bool)
    found = long_term(overlap, confidence, present)
    if not present.any():
        assert np.isnan(found.f)
        return
    tried = [0.0]
    for threshold in (0.1, 0.5, 0.9):
        said = confidence >= threshold
        if said.any():
            precision = (overlap * present)[said].sum() / said.sum()
            recall = (overlap * present)[said].sum() / present.sum()
            tried.append(0.0 if precision + recall == 0 else 2 * precision * recall / (precision + recall))
    assert found.f == pytest.approx(max(tried))


def test_score_of_an_occlusion_by_hand() -> None:
    """Frames 0..20; hidden in 5..7, 10 px away in 8 and 9 (within the diagonal: on it), off from 10 on."""
    offsets = np.zeros((21, 2))
    offsets[8:10] = [6.0, 8.0]
    offsets[10:] = [30.0, 40.0]
    visible = np.ones(21)
    visible[5:8] = 0.0
    said = ["tracking"] * 6 + ["occluded"] * 2 + ["tracking"] * 5 + ["lost"] * 8
    figures = score_trace(trace_of(offsets, said, visible))
    assert (figures.lost, figures.lost_at, figures.frames, figures.held_frames) == (True, 110, 20, 9)
    assert (figures.returns, figures.reacquired, figures.reacquired_after) == (1, 1, 0.0)
    assert figures.hidden_tracking == pytest.approx(1 / 3)
    assert figures.false_tracking == pytest.approx(3 / 11)
    assert (figures.false_lost, figures.lost_late) == (0.0, 3.0)
    assert figures.nees == pytest.approx((7 * 0 + 2 * 100 / 4) / 9)
    assert figures.neff == pytest.approx(np.linspace(10, 20, 21)[1:].mean())
    # overlaps: 7 frames 1, the rest 0: boxes 6x8 shifted by (6, 8) only touch
    assert figures.overlap == pytest.approx(7 / 20)
    assert figures.success_50 == figures.success_75 == 7 / 20
    # it points at something in 12 frames after the start, 9 of them shown; 4 of the overlaps of 1 are shown
    assert figures.lt_precision == pytest.approx(4 / 12)
    assert figures.lt_recall == pytest.approx(4 / 17)


def test_every_figure_has_a_direction_and_a_type() -> None:
    figures = score_trace(trace_of(np.zeros((4, 2)), ["tracking"] * 4, np.ones(4))).as_dict()
    assert list(figures) == list(FIGURES)
    assert Score.from_dict(figures).as_dict() == figures
    for name, column in FIGURES.items():
        assert figures[name] is None or isinstance(figures[name], column.kind), name
        assert column.better in ("less", "more", None), name


def test_docs_name_every_figure() -> None:
    page = (Path(__file__).parents[3] / "docs" / "metrics.md").read_text()
    plain = [name for name in FIGURES if not name.endswith("_held")]
    assert [name for name in plain if f"`{name}`" not in page] == []
