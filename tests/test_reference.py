"""The truth of one target as arrays, and the interval of a share of runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from irsim.types import Box, TargetTruth, Truth
from irtrack.metrics import Reference, wilson


def test_reference_from_truths() -> None:
    box = Box(5.0, 6.0, 4.0, 3.0)
    seen = TargetTruth("a", (5.0, 6.0), box, visible=0.25, accuracy_px=1.5)
    truths = [
        Truth(3, 0.3, (TargetTruth("b", (1.0, 1.0), box), seen)),
        Truth(4, 0.4, ()),
        Truth(5, 0.5, (replace(seen, visible=None, in_view=None),)),
        Truth(6, 0.6, (replace(seen, in_view=False),)),
        Truth(7, 0.7, (replace(seen, visible=0.5),)),
    ]
    reference = Reference.of(truths, "a")
    assert reference.indices.tolist() == [3, 4, 5, 6, 7]
    assert reference.present.tolist() == [True, False, True, False, True]  # no entry; out of view
    assert reference.shown.tolist() == [False, False, True, False, True]
    assert reference.centers[0].tolist() == [5.0, 6.0]
    assert reference.diagonals[0] == 5.0
    assert reference.accuracy[0] == 1.5
    assert not Reference.of(truths, None).present.any()
    assert len(Reference.of([], "a").indices) == 0
    assert not Reference.of([], "a").at(np.arange(3)).present.any()


@pytest.mark.parametrize(
    ("count", "total", "low", "high"),
    # Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3 (score without correction)
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_gives_the_printed_intervals(count: int, total: int, low: float, high: float) -> None:
    assert wilson(count, total) == pytest.approx((low, high), abs=5e-5)


@given(st.integers(1, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
@settings(max_examples=30, deadline=None)
def test_wilson_equals_scipy(case: tuple[int, int]) -> None:
    count, total = case
    other = binomtest(count, total).proportion_ci(method="wilson")
    assert wilson(count, total) == pytest.approx((other.low, other.high), abs=1e-12)


def test_no_runs_tell_nothing() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
