"""Intervals of means and of shares, against another library, and which of them a chart takes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from irsim.measure.interval import jackknife
from irsim.rng import stream
from irtrack.metrics import mean_interval, wilson
from irtrack.papers.tables import interval


@pytest.mark.parametrize(("count", "level"), [(2, 0.95), (8, 0.95), (30, 0.9)])
def test_the_interval_of_a_mean_is_students(count: int, level: float) -> None:
    """Column by column, beside scipy.stats."""
    values = stream(0, "values").normal(3, 2, (count, 4))
    mean, low, high = mean_interval(values, level)
    expected = stats.t.interval(level, count - 1, values.mean(axis=0), stats.sem(values, axis=0))
    assert mean == pytest.approx(values.mean(axis=0))
    assert np.array([low, high]) == pytest.approx(np.array(expected))


@pytest.mark.parametrize("count", [2, 8, 36])
def test_leaving_out_one_by_one_gives_students_interval_of_a_mean(count: int) -> None:
    """The jackknife of a mean is its standard error exactly (Efron 1982, section 3.1), beside scipy.stats."""
    blocks = stream(0, "blocks").normal(3, 2, (count, 4))
    found = jackknife(blocks, lambda mean: mean)
    low, high = stats.t.interval(0.95, count - 1, blocks.mean(axis=0), stats.sem(blocks, axis=0))
    assert [each.value for each in found] == pytest.approx(list(blocks.mean(axis=0)))
    assert [each.low for each in found] == pytest.approx(list(low))
    assert [each.high for each in found] == pytest.approx(list(high))


def test_one_value_says_nothing_of_its_interval() -> None:
    mean, low, high = mean_interval(np.array([[1.0, 2.0]]))
    assert (mean.tolist(), low.tolist(), high.tolist()) == ([1, 2], [-np.inf] * 2, [np.inf] * 2)


def test_charts_take_wilsons_interval_for_yes_and_no() -> None:
    """Ten of ten lost is no certainty: .722 to 1 (R: prop.test)."""
    assert interval([True] * 10) == (1.0, *wilson(10, 10))
    assert interval([True] * 10)[1] == pytest.approx(0.722, abs=5e-4)
    assert interval([True]) == (1.0, *wilson(1, 1))


def test_charts_take_students_interval_for_means() -> None:
    """1, 2, 3: the standard error is 1 / sqrt 3, t of 2 degrees of freedom is 4.303 (any table)."""
    reach = 4.303 / np.sqrt(3)
    assert interval([1.0, 2.0, 3.0]) == pytest.approx((2, 2 - reach, 2 + reach), abs=1e-3)
    assert interval([1.0] * 3) == (1, 1, 1)
    assert interval([2.5]) == (2.5, 2.5, 2.5)
