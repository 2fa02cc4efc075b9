"""Shares, heights and times of bad pixels: in their intervals, or told as ends where nobody can know them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from even_noise import rendered
from intervals import held

import irsim
from irsim.camera.bad_pixels import BadPixels
from irsim.measure import defects, measure_figures, measure_noise
from irsim.measure.defects import stirred
from irsim.measure.flaws import Flaws
from irsim.measure.region import Region
from irsim.types import Floats

SIGMA = 10.0
"""Of the noise of `even_noise.rendered`, counts."""


def going_to_and_fro(shape: tuple[int, int, int], pixels: int, seed: int, sigmas: float, more: float = 0.0) -> Floats:
    """White noise of 10 counts and pixels, none beside another, that go to and fro by so many sigmas and an exponential
    number of `more` besides."""
    rng = np.random.default_rng(seed)
    frames = rendered(seed, shape, {"kind": "white"})
    free = [(y, x) for y in range(4, shape[1] - 4, 6) for x in range(4, shape[2] - 4, 6)]
    for k in rng.choice(len(free), pixels, replace=False):
        high = np.cumsum(rng.random(shape[0]) < 0.2) % 2
        frames[:, free[k][0], free[k][1]] += np.rint(SIGMA * (sigmas + rng.exponential(more)) * high)
    return frames


def flaws_of(frames: Floats, boxes: tuple[tuple[Region, ...], ...] | None = None) -> Flaws:
    return measure_figures(frames, 30.0, passing=False, boxes=boxes).flaws


@pytest.mark.sampled
@pytest.mark.parametrize("sigmas", [6.5, 7, 8, 10, 15, 30])
def test_jumps_that_are_alike_make_up_no_others(sigmas: float) -> None:
    """Of 35 of 7 sigmas it was said that every pixel blinks."""
    found = flaws_of(going_to_and_fro((100, 96, 128), 35, 1, sigmas))
    assert found.blinking.value == pytest.approx(35 / (96 * 128), rel=0.2)
    assert found.blinking.low <= 35 / (96 * 128) <= found.blinking.high
    assert found.jump is not None
    assert found.jump.value == pytest.approx(SIGMA * sigmas, rel=0.1)
    assert found.jump.low <= SIGMA * sigmas <= found.jump.high
    if sigmas >= 15:  # the exponential law that reaches farthest down
        assert found.blinking.high < 0.02


@cache
def exponential(seed: int) -> Flaws:
    """Of 123 pixels, in the mean of 12 sigmas: a half jump too little to be seen."""
    return flaws_of(going_to_and_fro((100, 96, 128), 123, seed, 0, 12))


def test_those_that_jump_too_little_to_be_seen_are_counted_by_the_law_of_the_others() -> None:
    found = [exponential(seed) for seed in range(6)]
    shares, jumps = [each.blinking for each in found], [each.jump for each in found if each.jump is not None]
    held(shares, 123 / (96 * 128))
    held(jumps, 12 * SIGMA)
    assert np.mean([each.value for each in shares]) == pytest.approx(0.01, rel=0.25)
    assert np.median([each.high / each.low for each in shares]) < 3.5


def test_a_few_tell_only_how_many_there_may_be() -> None:
    found = flaws_of(going_to_and_fro((100, 96, 128), 5, 3, 9, 20)).blinking
    assert found.value == pytest.approx(5 / (96 * 128))
    assert found.low < found.value < found.high / 2


def test_shares_are_of_the_pixels_of_which_it_can_be_told() -> None:
    """A half full of light, a third in a target's box, and in that much that changes, tell of no pixel: dead and
    blinking ones were said to be half as many, or a fifth more."""
    rng = np.random.default_rng(2)
    frames = going_to_and_fro((80, 96, 192), 150, 4, 12, 40)
    dead = rng.random((96, 192)) < 0.01
    frames[:, dead] = 200
    box = np.s_[:, :, :48]
    boxes = ((Region(0, 0, 48, 96),),) * 80
    alone = flaws_of(frames, boxes).blinking
    swaying = frames.copy()
    swaying[box] += 60 * rng.standard_normal((80, 1, 1)) * np.hanning(48)
    assert flaws_of(swaying, boxes).blinking.value == pytest.approx(alone.value, rel=0.02)
    full = frames.copy()
    full[:, :, 96:] = 65535
    found, report = flaws_of(full), measure_noise(full, 30.0)
    assert found.dead.value == pytest.approx(dead[:, :94].mean(), rel=0.05)
    assert report.pixels == 96 * 94  # two more lie beside what is full
    assert report.dead == dead[:, :94].sum()


@pytest.mark.parametrize("level", [1000, 65001])
def test_noise_of_a_bright_recording_is_no_scene_that_changes(level: int) -> None:
    """Of 8000 frames at 65001 counts sums of float32 made a sigma of 3 of 0.55, and all was said to change."""
    rng = np.random.default_rng(1)
    frames = np.rint(level + 0.45 * rng.standard_normal((8000, 8, 8)))
    assert not stirred(frames.astype(np.float32), 0.55).any()


def test_a_fit_of_jumps_that_are_alike_says_what_it_does_not_know(tmp_path: Path) -> None:
    """It wrote a fifth of all pixels."""
    for k, frame in enumerate(np.rint(going_to_and_fro((60, 96, 128), 35, 1, 7)).astype(np.uint16)):
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), frame)
    found = irsim.fit(irsim.import_frames(tmp_path, tmp_path / "alike.mcap"))
    (bad,) = [noise for noise in found.scenario.camera.noise if isinstance(noise, BadPixels)]
    assert bad.blinking == pytest.approx(35 / (96 * 128), rel=0.3)
    (told,) = [text for label, text in found.summary() if "blinking" in text]
    assert "blinking at least 0.00" in told


def test_frames_less_their_first_are_no_whole_counts() -> None:
    """In degrees, of all pixels that blink none was told: a first frame of zeros was taken for counts."""
    frames = going_to_and_fro((80, 64, 64), 12, 5, 20) / 200
    less = frames - frames[0]
    assert not measure_noise(less, 30.0).rounded
    assert measure_noise(less, 30.0).blinking == measure_noise(frames, 30.0).blinking == 12


def test_pixels_that_are_not_counted_make_no_clusters_smaller() -> None:
    """Ten groups of three that are hot, and 60 that blink weakly, each alone."""
    frames = going_to_and_fro((80, 96, 128), 60, 6, 5)
    for k in range(10):
        frames[:, 7 + 6 * k, 8:11] += 500
    bad = defects(frames)
    assert bad.faint.sum() > 10
    assert flaws_of(frames).cluster > 1.6
