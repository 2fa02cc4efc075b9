"""The breaking point and its interval in closed cases."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irsim.types import Floats
from irtrack.metrics import breaking_point, wilson


def runs(*lost: int, of: int) -> tuple[Floats, np.ndarray]:
    """Severities and losses of `of` runs at each severity from 0 on, so many of them lost."""
    severities = np.repeat(np.arange(len(lost), dtype=float), of)
    return severities, np.concatenate([np.arange(of) < count for count in lost])


def test_shares_that_rise_are_joined_by_lines() -> None:
    found = breaking_point(*runs(0, 2, 8, 10, of=10))
    assert found is not None
    assert found.at == pytest.approx(1.5)  # between .2 at 1 and .8 at 2
    assert found.shares.tolist() == [0, 0.2, 0.8, 1]
    assert (found.low[1], found.high[1]) == wilson(2, 10)


def test_interval_by_wilson() -> None:
    # Wilson at 30 runs: 9 lost is at most .479 < .5, 10 is .513; 21 is at least .521 > .5, 20 is .488
    found = breaking_point(*runs(0, 9, 15, 21, 30, of=30))
    assert found is not None
    assert (found.at_low, found.at_high) == (1, 3)
    assert found.in_words() == "2 (1 to 3)"
    wider = breaking_point(*runs(0, 10, 15, 20, 30, of=30))
    assert wider is not None
    assert (wider.at_low, wider.at_high) == (0, 4)


def test_open_ends_of_the_interval() -> None:
    never, always = breaking_point(*runs(0, 0, 1, of=30)), breaking_point(*runs(30, 30, of=30))
    assert never is not None
    assert always is not None
    assert (never.at, never.at_low, never.at_high) == (math.inf, 2, math.inf)
    assert (always.at, always.at_low, always.at_high) == (-math.inf, -math.inf, 0)
    assert (never.in_words(), always.in_words()) == ("> 2", "< 0")
    doubtful = breaking_point(*runs(0, 10, 14, of=30))
    assert doubtful is not None
    assert doubtful.in_words() == "> 2 (0 to > 2)"
    assert breaking_point([], []) is None


@given(st.lists(st.tuples(st.integers(0, 5), st.booleans()), min_size=1, max_size=60))
def test_the_point_lies_in_its_interval_in_any_order(cells: list[tuple[int, bool]]) -> None:
    severities, lost = [float(s) for s, _ in cells], [hit for _, hit in cells]
    found = breaking_point(severities, lost)
    again = breaking_point(severities[::-1], lost[::-1])
    assert found is not None
    assert again is not None
    assert found.at_low <= found.at <= found.at_high
    assert (found.at, found.at_low, found.at_high) == (again.at, again.at_low, again.at_high)
