"""Errors as multiples of the bound: planted errors, suppressed frames, losses."""

from __future__ import annotations

import numpy as np
import pytest
from traces import trace_at

from irsim.types import TargetBounds
from irtrack.metrics.bound import TargetBound, bound_figures, ratios_by_d


def bound(n: int, sd: tuple[float, float] = (0.1, 0.2), d: float = 20.0) -> TargetBound:
    return TargetBound(np.arange(n), np.tile(sd, (n, 1)), np.full(n, d))


def test_errors_drawn_at_twice_the_bound_have_a_ratio_of_two() -> None:
    rng, n = np.random.default_rng(1), 4000
    traces = [trace_at(rng.normal(0, 2, (n, 2)) * (0.1, 0.2)) for _ in range(4)]
    found = bound_figures(traces, [bound(n)] * 4)
    assert found.ratio == pytest.approx(2, rel=0.02)
    assert found.ratio is not None
    assert found.low is not None
    assert found.high is not None
    assert found.low < found.ratio < found.high
    assert (found.runs, found.lost, found.frames) == (4, 0, 4 * (n - 1))  # the start frame is not scored
    assert found.spread_x == pytest.approx(0.2, rel=0.05)
    assert found.spread_y == pytest.approx(0.4, rel=0.05)
    assert found.bias_x == pytest.approx(0, abs=0.01)


def test_bias_counts_in_the_ratio() -> None:
    found = bound_figures([trace_at(np.tile((0.3, -0.2), (9, 1)))], [bound(9)])
    assert found.ratio == pytest.approx(np.sqrt((3**2 + 1) / 2))
    assert found.bias_x == pytest.approx(0.3)
    assert found.bias_y == pytest.approx(-0.2)
    assert found.spread_x == pytest.approx(0)
    assert found.low is None  # of one run


@pytest.mark.parametrize("other", [bound(9, d=9.9), bound(9, sd=(0.1, 0.029)), TargetBound.of([], "a")])
def test_no_ratio_where_the_bound_is_small_or_does_not_hold(other: TargetBound) -> None:
    found = bound_figures([trace_at(np.ones((9, 2)))], [other])
    assert (found.runs, found.frames, found.ratio) == (1, 0, None)
    part = TargetBound(np.arange(9), other.sds, other.d) if len(other.d) else other
    assert not part.holds(np.arange(12)).any()


def test_frames_after_the_loss_do_not_count() -> None:
    offsets = np.zeros((40, 2))
    offsets[1:20, 0] = 0.1
    offsets[20:] = 50.0
    found = bound_figures([trace_at(offsets)], [bound(40)])
    assert (found.lost, found.lost_share, found.frames) == (1, 1.0, 19)
    assert found.ratio == pytest.approx(np.sqrt(0.5))


def test_bounds_of_rows_are_found_by_frame() -> None:
    rows = [
        TargetBounds(k, name, 0.1 * k, 0.2 * k, 0.0, 10.0 + k, None, None, (0, 0, 1, 1))
        for k in (1, 2, 5)
        for name in ("a", "b")
    ]
    found = TargetBound.of(rows, "a")
    sds, d = found.at(np.array([0, 2, 5, 7]))
    np.testing.assert_allclose(sds, [[np.nan] * 2, [0.2, 0.4], [0.5, 1.0], [np.nan] * 2])
    np.testing.assert_allclose(d, [np.nan, 12, 15, np.nan])


def test_ratios_follow_d() -> None:
    """Errors of once the bound where d is below 20, and of three times the bound above."""
    rng, n = np.random.default_rng(2), 2000
    d = np.tile([12.0, 40.0], n // 2) + np.linspace(0, 0.1, n)
    own = TargetBound(np.arange(n), np.tile((0.1, 0.2), (n, 1)), d)
    scale = np.where(d < 20, 1.0, 3.0)[:, None] * (0.1, 0.2)
    curve = ratios_by_d([trace_at(rng.normal(0, 1, (n, 2)) * scale) for _ in range(4)], [own] * 4)
    assert len(curve) == 8
    np.testing.assert_allclose(curve[:, 0], [12] * 4 + [40] * 4, atol=0.1)
    np.testing.assert_allclose(curve[:, 1], [1] * 4 + [3] * 4, rtol=0.06)
    assert (curve[:, 2] < curve[:, 1]).all()
    assert (curve[:, 3] > curve[:, 1]).all()
    assert not len(ratios_by_d([trace_at(np.zeros((29, 2)))], [bound(29)]))
