"""Repeated and lost frames, jumps of the picture and steps of the fixed pattern are found, and left out."""

from __future__ import annotations

import numpy as np
import pytest
from calibration_clips import noise_frames, rendered, series

from irsim.calibration import measure_noise
from irsim.calibration.stretch import jumps, new_frames, pattern_steps
from irsim.errors import InputError
from irsim.types import Floats

RATE_HZ = 30.0
SCENE = "frames: 60\ncamera: {preset: uncooled_lwir, size: [96, 80]}\nbackground: {kind: ground, spread_k: 2}\n"


def taken(numbers: list[int]) -> tuple[Floats, Floats]:
    """Return white noise at frames of the camera, equal for equal numbers, and its times, s."""
    drawn = np.random.default_rng(0).normal(0, 1, (max(numbers) + 1, 16, 16))
    return drawn[numbers], 100 + np.array(numbers) / RATE_HZ


@pytest.mark.parametrize(
    ("numbers", "index", "lost"),
    [
        ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5], 0),
        ([0, 1, 4, 5, 6, 9], [0, 1, 2, 3, 4, 5], 4),
        ([0, 1, 1, 2, 5, 5, 6], [0, 1, 3, 4, 6], 2),
    ],
)
def test_times_show_lost_frames(numbers: list[int], index: list[int], lost: int) -> None:
    frames, times = taken(numbers)
    found = new_frames(frames, RATE_HZ, times)
    assert found.index.tolist() == index
    assert found.number.tolist() == sorted(set(numbers))
    assert found.lost == lost
    assert new_frames(frames, RATE_HZ).lost == 0
    late = times + np.random.default_rng(1).uniform(0, 0.9, len(times)) / RATE_HZ  # irregular
    assert new_frames(frames, RATE_HZ, late).lost == 0


def test_repeated_frames_and_a_slow_camera() -> None:
    frames, _ = taken(list(range(40)))
    doubled = np.repeat(frames, 2, axis=0)
    found = new_frames(doubled, 2 * RATE_HZ)
    assert (found.rate_hz, found.slower) == (RATE_HZ, 2)
    frozen = frames.copy()
    frozen[11:16] = frozen[10]
    found = new_frames(frozen, RATE_HZ)
    assert found.number.tolist() == [*range(11), *range(16, 40)]
    once = frames.copy()
    once[11] = once[10]
    assert new_frames(once, RATE_HZ).number.tolist() == list(range(39))


def test_a_long_pause_cuts_the_recording() -> None:
    frames, times = taken(list(range(40)))
    times[20:] += 3600
    found = new_frames(frames, RATE_HZ, times)
    assert found.pauses == (20,)
    report = measure_noise(frames[5:], RATE_HZ, (0, 0, 16, 16), times=times[5:])
    assert report.stretch.index == tuple(range(15, 35))


@pytest.mark.parametrize(("first", "count", "cuts"), [(0, 3, [3]), (40, 1, [40, 41]), (59, 1, [59])])
def test_a_shutter_is_a_jump(first: int, count: int, cuts: list[int]) -> None:
    frames = rendered(SCENE).copy()
    frames[first : first + count] = int(frames.mean()) + 200
    assert jumps(list(frames)) == cuts


def test_a_level_that_wanders_and_a_moving_scene_are_no_jumps() -> None:
    frames = noise_frames(1, (60, 64, 64), tvh=2.0) + series(np.random.default_rng(2), (60, 1, 1), 5.0, 0.9)
    assert jumps(list(frames)) == []
    slide = np.random.default_rng(3).normal(0, 20, (64, 200))
    assert jumps([slide[:, 2 * k : 2 * k + 64] for k in range(60)]) == []


@pytest.mark.parametrize("steps", [(30,), (30, 60)])
def test_a_correction_is_a_step(steps: tuple[int, ...]) -> None:
    rng = np.random.default_rng(100)
    patterns = rng.normal(0, 6, (len(steps) + 1, 48, 48))
    shown = np.searchsorted(steps, np.arange(90), side="right")
    frames = noise_frames(0, (90, 48, 48), tvh=10.0) + patterns[shown]
    assert pattern_steps(frames) == list(steps)
    report = measure_noise(frames, RATE_HZ, (0, 0, 48, 48))
    assert report.stretch.breaks.steps == steps
    assert report.terms.vh.low <= 6 <= report.terms.vh.high


def test_drift_correlated_noise_and_motion_are_no_steps() -> None:
    rng = np.random.default_rng(0)
    white = rng.normal(0, 1, (100, 48, 48))
    assert pattern_steps(white) == []
    assert pattern_steps(white + rng.normal(0, 0.3, (100, 48, 48)).cumsum(axis=0)) == []
    assert pattern_steps(white + series(rng, (100, 48, 48), 3.0, 0.9)) == []
    wave = 5 * np.sin(np.arange(48)[None, None, :] / 4 + np.arange(100)[:, None, None] / 5)
    assert pattern_steps(white + wave) == []


def test_left_out_frames_are_noted() -> None:
    frames = noise_frames(1, (60, 64, 64), tvh=2.0)
    frames[40:43] += 300
    report = measure_noise(frames, RATE_HZ, (0, 0, 64, 64))
    (sentence,) = report.stretch.left_out(10)
    assert sentence.startswith("the whole picture changes at frames 50, 53: frames 10 to 49 are measured")


def test_too_short_a_stretch_is_one_clear_error() -> None:
    frames = noise_frames(1, (8, 64, 64), tvh=2.0)
    frames[3:5] += 3000
    with pytest.raises(InputError, match=r"the whole picture changes at frames 3, 5: .* has 3 frames, too few"):
        measure_noise(frames, RATE_HZ, (0, 0, 64, 64))
