"""Frames that were lost on their way: the times of the others tell of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import irsim
from irsim.measure.repeats import new_frames
from irsim.types import Floats

RATE_HZ = 30.0

SCENE = """
frames: 120
seed: {seed}
camera:
  size: [128, 96]
  range_k: [270, 320]
  netd_mk: 60
  faults: [{{kind: drop, rate: 0.15}}]
  noise: [{{kind: white, ratio: 0.6}}, {{kind: ar1, ratio: 0.8, time_constant_s: 0.3}}]
background: {{kind: ground, spread_k: 0}}
"""


def taken(numbers: list[int], seed: int = 0) -> tuple[Floats, Floats]:
    """Frames of white noise taken at these frames of the camera, alike where numbers are, and their times."""
    drawn = np.random.default_rng(seed).normal(0, 1, (max(numbers) + 1, 16, 16))
    return drawn[numbers], 100 + np.array(numbers) / RATE_HZ


@pytest.mark.parametrize(
    ("numbers", "index", "lost"),
    [
        ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5], 0),
        ([0, 1, 4, 5, 6, 9], [0, 1, 2, 3, 4, 5], 4),
        ([0, 1, 1, 2, 5, 5, 6], [0, 1, 3, 4, 6], 2),
    ],
)
def test_times_tell_of_lost_frames(numbers: list[int], index: list[int], lost: int) -> None:
    frames, times = taken(numbers)
    found = new_frames(frames, RATE_HZ, times)
    assert found.index.tolist() == index
    assert found.number.tolist() == sorted(set(numbers))
    assert found.lost == lost
    assert new_frames(frames, RATE_HZ).lost == 0


def test_times_that_keep_no_beat_tell_nothing() -> None:
    """Frames that are stamped as they come: each some way late, some so much that a frame seems to be missing."""
    frames, times = taken(list(range(40)))
    late = times + np.random.default_rng(1).uniform(0, 0.9, 40) / RATE_HZ
    assert new_frames(frames, RATE_HZ, late).number.tolist() == list(range(40))


def test_no_time_passes_for_repeats_of_the_same_time_however_many() -> None:
    """Each frame comes twice or three times at its own time: the camera is no slower."""
    frames, times = taken([number for number in range(40) for _ in range(2 + number % 2)])
    found = new_frames(frames, RATE_HZ, times)
    assert (found.rate_hz, found.lost, found.number.tolist()) == (RATE_HZ, 0, list(range(40)))


def test_a_camera_is_as_slow_as_the_least_time_between_its_frames() -> None:
    """Recorded as if it were twice as fast, and nothing is lost; with one frame lost that one is."""
    frames, times = taken(list(range(40)))
    found = new_frames(frames, 2 * RATE_HZ, times)
    assert (found.rate_hz, found.lost, found.number.tolist()) == (RATE_HZ, 0, list(range(40)))
    found = new_frames(np.delete(frames, 7, axis=0), 2 * RATE_HZ, np.delete(times, 7))
    assert (found.rate_hz, found.lost) == (RATE_HZ, 1)
    assert found.number.tolist() == [k for k in range(40) if k != 7]


def test_times_of_which_hardly_two_are_a_period_apart_tell_nothing() -> None:
    numbers = [5 * (k // 2) + 2 * (k % 2) for k in range(40)]
    frames = taken(list(range(40)))[0]
    found = new_frames(frames, RATE_HZ, np.array(numbers) / RATE_HZ)
    assert (found.rate_hz, found.lost, found.number.tolist()) == (RATE_HZ, 0, list(range(40)))


def test_a_long_pause_counts_as_four_times_the_frames() -> None:
    frames, times = taken(list(range(40)))
    times[20:] += 3600
    found = new_frames(frames, RATE_HZ, times)
    assert found.number[19] == 19
    assert found.number[20] == 20 + 4 * 40
    assert found.lost == 3600 * RATE_HZ


def test_lost_frames_are_those_of_a_slower_camera_that_is_recorded_thrice() -> None:
    frames, times = taken([number for number in range(12) if number not in (5, 6) for _ in range(3)])
    times += np.tile(np.arange(3), 10) / (3 * RATE_HZ)
    found = new_frames(frames, 3 * RATE_HZ, times)
    assert found.number.tolist() == [0, 1, 2, 3, 4, 7, 8, 9, 10, 11]
    assert found.lost == 2


def test_memory_is_measured_where_frames_are_lost() -> None:
    """9 frames of time constant, of eight renders in each of which some 18 of 120 frames are lost."""
    held = 0
    for seed in range(8):
        fitted = irsim.fit(irsim.loads(SCENE.format(seed=seed)))
        assert any("frames are missing, by the times of the others" in note for note in fitted.notes)
        memory = fitted.figures.memory_frames
        assert memory is not None
        held += memory.low <= 9 <= memory.high
    assert held >= 6  # 8 at 95 %: fewer than 6 in 1 of 170


@pytest.mark.parametrize("times", [np.arange(7.0), np.arange(8.0)[::-1], np.full(8, np.nan), [0.0] * 8])
def test_times_that_are_none_are_refused(times: Any) -> None:
    frames, _ = taken(list(range(8)))
    with pytest.raises(irsim.InputError, match=r"^times: .*; allowed: None, or an array of numbers of shape \(8,\)"):
        irsim.measure_noise(frames, RATE_HZ, times=times)
