"""The paired difference of two trackers on the same scenes, and its interval."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irtrack.metrics import Difference, paired_difference, scenes_for


def test_pairs_by_hand() -> None:
    old = np.arange(6.0)
    same = paired_difference([*(old + 1), np.nan], [*old, 5.0], [*"abcdef", "f"])
    assert same is not None
    assert (same.mean, same.low, same.high) == pytest.approx((1, 1, 1))
    assert not same.is_tie
    assert (same.pairs, same.scenes) == (6, 6)
    few = paired_difference(old[:5] + 1, old[:5], [*"abcde"])  # one sign five times: p = 2 / 32
    assert few is not None
    assert few.is_tie
    assert few.low == -np.inf
    assert few.is_open
    assert not same.is_open
    assert paired_difference([np.nan], [0.0], ["a"]) is None


# -- losses, and scenes that all differ by the same


def losses(more: int, fewer: int, scenes: int) -> Difference:
    """Of so many scenes, those that the first alone loses, and those that the second alone does."""
    first, second = [1.0] * more + [0.0] * (scenes - more), [0.0] * more + [1.0] * fewer
    second += [0.0] * (scenes - len(second))
    found = paired_difference(first, second, [str(k) for k in range(scenes)], most=1.0)
    assert found is not None
    return found


def test_interval_by_bonett_and_price() -> None:
    """26 of 48 one way, 4 the other: statpsych's ci.prop.ps (CRAN, its manual) prints 0.44, 0.2548067 to 0.6251933.

    The normal's 1.95996 stands there; here t of 49, 2.00958, and a sample's standard deviation.
    """
    found = losses(26, 4, 48)
    reach = (0.6251933 - 0.44) / 1.959964 * 2.009575 * math.sqrt(50 / 49)
    assert found.mean == pytest.approx(22 / 48)
    assert (found.low, found.high) == pytest.approx((0.44 - reach, 0.44 + reach), abs=1e-6)


def test_equal_differences_have_a_wide_interval() -> None:
    """No scene that differs, or all: the interval has a width, and the more scenes the less of one."""
    none, every = losses(0, 0, 6), losses(6, 0, 6)
    assert (none.low, none.high) == pytest.approx((-0.447, 0.447), abs=1e-3)  # 2.365 sqrt(2 / 7) / sqrt(8)
    assert not every.is_tie
    assert (every.low, every.high) == pytest.approx((0.159, 1.0), abs=1e-3)  # 0.75 - 2.365 sqrt(1 / 2) / sqrt(8)
    assert losses(0, 0, 60).high < 0.05
    shares = paired_difference([0.5, 0.6, 0.7, 0.5, 0.6, 0.7], [0.5] * 6, [*"abcdef"], most=1.0)
    assert shares is not None
    assert shares.high - shares.low < 0.3  # percentiles, as of any figure
    pixels = paired_difference([0.0] * 6, [0.0] * 6, [*"abcdef"])  # nothing bounds what the next scene might do
    assert pixels is not None
    assert (pixels.low, pixels.high) == (0, 0)


@pytest.mark.parametrize(("more", "fewer", "scenes"), [(0, 0, 6), (1, 0, 6), (2, 2, 6), (3, 1, 10), (26, 4, 48)])
def test_scenes_for_gives_the_interval_of_losses(more: int, fewer: int, scenes: int) -> None:
    """Twenty times as many scenes, lost in the same shares: just so many are said to give just that interval."""
    many = losses(20 * more, 20 * fewer, 20 * scenes)
    half_width = (many.high - many.low) / 2
    found = losses(more, fewer, scenes)
    assert scenes_for(found, half_width * (1 + 1e-9)) == 20 * scenes
    assert scenes_for(found, half_width * (1 - 1e-9)) == 20 * scenes + 1
