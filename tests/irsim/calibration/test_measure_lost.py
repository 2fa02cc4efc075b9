"""Frames that were lost on their way: the times of the others tell of them."""

from __future__ import annotations

from dataclasses import replace
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


@pytest.mark.parametrize("kind", [np.int8, np.int64, np.float32])
def test_times_of_any_type_tell_of_lost_frames(kind: type) -> None:
    """Two of them may lie farther apart than numbers of their type reach."""
    numbers = [0, 1, 2, 3, 203, 204, 205, 206]
    found = new_frames(taken(numbers)[0], 1.0, (np.array(numbers) - 100).astype(kind))
    assert (found.number.tolist(), found.lost) == (numbers, 199)


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


def test_a_recording_is_cut_at_pauses_longer_than_noise_remembers() -> None:
    frames, times = taken(list(range(40)))
    times[20:] += 3600
    times[30:] += 90
    found = new_frames(frames, RATE_HZ, times)
    assert found.number[[19, 20]].tolist() == [19, 20 + 3600 * RATE_HZ]
    assert found.lost == 3690 * RATE_HZ
    assert found.pauses == (20,)


@pytest.mark.parametrize("far", [1e5, 1e9, 1e300])
def test_many_pauses_are_no_trouble_however_long(far: float) -> None:
    """Bursts of four frames: as far apart as times tell, each is a piece of its own."""
    frames = np.random.default_rng(0).normal(0, 1, (4000, 4, 4))
    times = np.arange(4000) / RATE_HZ + np.repeat(np.arange(1000.0), 4) * far
    assert new_frames(frames, RATE_HZ, times).pauses == (tuple(range(4, 4000, 4)) if far < 1e10 else ())


WALKED = """
frames: 160
seed: {seed}
camera:
  size: [80, 80]
  range_k: [270, 320]
  netd_mk: 60
  noise: [{{kind: white, ratio: 1}}, {{kind: drift, pixel: 2, time_constant_s: 600}}]
background: {{kind: ground, spread_k: 0}}
"""


def test_what_drifts_is_told_from_the_longest_stretch_between_pauses() -> None:
    """Sixty frames, an hour's pause, a hundred more: as those hundred alone say."""
    for seed in range(3):
        frames = np.stack([frame.image for frame, _ in irsim.frames(irsim.loads(WALKED.format(seed=seed)))])
        times = np.arange(160) / RATE_HZ
        times[60:] += 3600
        report = irsim.measure_noise(frames, RATE_HZ, times=times)
        assert report == replace(
            irsim.measure_noise(frames[60:], RATE_HZ), stretch=report.stretch, region=report.region
        )
        assert list(report.stretch.left_out(5)) == [
            "108000 frames are missing, by the times of the others",
            "more time goes by before frame 65 than noise remembers: figures are those of frames 65 to 164, the "
            "longest stretch without such a break",
        ]


def test_stretches_too_short_to_measure_are_refused_with_the_cause() -> None:
    frames, times = taken(list(range(6)))
    times[3:] += 3600
    with pytest.raises(irsim.InputError, match=r"^more time goes by before frame 13 .* has 3 frames, .* at least 4$"):
        irsim.measure_noise(frames, RATE_HZ, times=times, start=10)


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


@pytest.mark.parametrize(
    "times",
    [np.arange(7.0), np.arange(8.0)[::-1], np.arange(8, dtype=np.uint64)[::-1], np.full(8, np.nan), [0.0] * 8],
)
def test_times_that_are_none_are_refused(times: Any) -> None:
    frames, _ = taken(list(range(8)))
    with pytest.raises(irsim.InputError, match=r"^times: .*; allowed: None, or an array of numbers of shape \(8,\)"):
        irsim.measure_noise(frames, RATE_HZ, times=times)
