"""How work is dealt out between a worker and this process."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irsim.balance import Balance

PIECE = 8
"""Frames in a piece of work."""


@given(st.integers(0, 9), st.lists(st.tuples(st.floats(0, 2), st.integers(1, 20)), max_size=40))
def test_no_frame_has_more_steps_than_there_are(most: int, story: list[tuple[float, int]]) -> None:
    balance = Balance(most)
    for left, count in story:
        balance.heed(left)
        steps = balance.steps(count)
        assert len(steps) == count
        assert all(0 <= step <= most for step in steps)
        assert max(steps) - min(steps) <= 1


@given(st.floats(0.0, 0.5), st.integers(1, 50))
def test_frames_have_whole_steps_and_their_mean_is_kept(left: float, count: int) -> None:
    balance = Balance(9)
    balance.heed(left)
    mean = balance.steps(10_000)
    assert sum(balance.steps(count)) == pytest.approx(count * sum(mean) / len(mean), abs=1.01)


def test_one_that_has_nothing_left_is_given_more_and_one_that_has_not_begun_less() -> None:
    balance = Balance(9)
    given = []
    for left in [0.0] * 20 + [1.0] * 60:
        balance.heed(left)
        given.append(sum(balance.steps(PIECE)))
    assert all(after > before - 2 for before, after in pairwise(given[:20]))
    assert given[0] < given[19] == 1.5 * PIECE
    assert given[20] < given[19]
    assert given[-1] == 0
    assert balance.exhausted


def test_where_all_is_a_workers_there_is_nothing_to_deal_out() -> None:
    balance = Balance(0)
    balance.heed(0.0)
    assert balance.steps(3) == [0, 0, 0]
    assert balance.exhausted


@pytest.mark.parametrize("scene", [0.2, 0.3, 0.4, 0.45])
@pytest.mark.parametrize("steps", [(0.04, 0.11, 0.09, 0.03), (0.2, 0.05), (0.1,) * 4])
def test_both_are_at_work_nearly_always(scene: float, steps: tuple[float, ...]) -> None:
    """A worker that may be two pieces ahead, of which the times are known: frames take it `scene` and its steps, this
    process the rest of 1. Both are done when the slower one is; half each would be 2 frames in a time of 1."""
    balance = Balance(len(steps))
    there = here = 0.0  # when each has done all that it was given
    taken: list[float] = []  # when places of a piece became free
    warm, pieces = 40, 240
    for piece in range(pieces):
        begin = taken[piece - 3] if piece >= 3 else 0.0
        done = max(there, begin)
        balance.heed(min(max((there - begin) / (PIECE * 0.5), 0.0), 1.0))
        for step in balance.steps(PIECE):
            work = scene + sum(steps[:step])
            done += work
            here = max(here, done) + 1 - work
        there = done
        taken.append(here)
    reachable = max(0.5, scene, 1 - scene - sum(steps))
    assert (taken[-1] - taken[warm]) / (PIECE * (pieces - 1 - warm)) < 1.05 * reachable
