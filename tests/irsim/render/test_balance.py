"""How work is dealt out between a worker and this process."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irsim.render.balance import Balance

PIECE = 8
"""Frames in a piece of work."""

WARM, MEASURED = 20, 100
"""Pieces."""


SHARES = st.lists(st.one_of(st.just(0.0), st.floats(0.001, 0.3)), max_size=8)


@given(st.floats(0, 1), SHARES, st.lists(st.tuples(st.floats(0, 2), st.integers(1, 20)), max_size=40))
def test_frames_have_steps_that_there_are(always: float, shares: list[float], story: list[tuple[float, int]]) -> None:
    balance = Balance(always, shares)
    for left, count in story:
        balance.heed(left)
        steps = balance.steps(count)
        assert len(steps) == count
        assert all(0 <= step <= len(shares) for step in steps)


@given(st.floats(0, 0.5), st.lists(st.floats(0.01, 0.3), min_size=1, max_size=8))
def test_what_steps_take_is_what_a_worker_lacks_to_half_a_frame(always: float, shares: list[float]) -> None:
    taken = [sum(shares[:step]) for step in Balance(always, shares).steps(1000)]
    assert np.mean(taken) == pytest.approx(min(0.5 - always, sum(shares)), abs=0.002)


def test_one_that_has_nothing_left_is_given_more_and_one_that_has_not_begun_less() -> None:
    balance = Balance(0.5, [0.1, 0.2, 0.1])
    dealt = []
    for left in [0.0] * 30 + [1.0] * 60:
        balance.heed(left)
        dealt.append(sum(balance.steps(PIECE)))
    assert 0 < dealt[0] < dealt[15] < dealt[29]
    assert dealt[30] < dealt[29]
    assert dealt[-1] == 0


def test_where_all_is_a_workers_there_is_nothing_to_deal_out() -> None:
    balance = Balance(1.0, ())
    balance.heed(0.0)
    assert balance.steps(3) == [0, 0, 0]


@pytest.mark.parametrize("scene", [0.2, 0.3, 0.4, 0.45])
@pytest.mark.parametrize("steps", [(0.04, 0.11, 0.0, 0.09, 0.03), (0.0, 0.0, 0.0, 0.0, 0.2, 0.05), (0.1,) * 4])
@pytest.mark.parametrize("wrong", [0.8, 1.0, 1.25])
def test_both_are_soon_at_work_nearly_always(scene: float, steps: tuple[float, ...], wrong: float) -> None:
    """A worker that may be two pieces ahead, and tells of two frames at a time. Frames take it `scene` and its steps,
    this process the rest of 1. Both are done when the slower one is; half each would be 2 frames in a time of 1."""
    balance = Balance(scene * wrong, steps)  # what was measured before they ran side by side
    work: list[float] = []  # of the worker, at each frame of a piece
    done: list[float] = []  # by the worker, when each frame was
    here = 0.0  # when this process has done all so far
    for piece in range(WARM + MEASURED):
        now = here if piece >= 2 else 0.0
        before, waiting = done[-PIECE:], [1 - each for each in work]
        balance.heed(2 * sum(end > now for end in before[1::2]) / PIECE)
        begin = max([now, *done[-1:]])
        work = [scene + sum(steps[:step]) for step in balance.steps(PIECE)]
        done += (begin + np.cumsum(work)).tolist()
        for end, own in zip(before, waiting, strict=True):  # taken while this piece is worked out
            here = max(here, end) + own
        if piece == WARM:
            start = here
    reachable = max(0.5, 1 - scene - sum(steps))
    assert (here - start) / (PIECE * (MEASURED - 1)) < 1.06 * reachable
