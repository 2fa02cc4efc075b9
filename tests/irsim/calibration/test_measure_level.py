"""The level of whole frames: its sigma and memory, and how likely they are beside the closed form by the whole
covariance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.measure import measure_noise, noise_lines
from irsim.measure.level import _likelihood, fit_level
from irsim.measure.region import Region
from irsim.types import Floats


def wandering(rng: np.random.Generator, count: int, time_frames: float) -> Floats:
    """(count,) AR(1) of unit sigma."""
    rho = np.exp(-1 / time_frames)
    levels = [rng.normal()]
    for _ in range(count - 1):
        levels.append(rho * levels[-1] + np.sqrt(1 - rho**2) * rng.normal())
    return np.array(levels)


@pytest.mark.slow
def test_a_level_lies_in_its_intervals_at_the_stated_rate() -> None:
    sigmas, times = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found = fit_level(3 * wandering(rng, 120, 8) + rng.normal(0, 0.3, 120), 0.09)
        assert found.time_frames is not None
        sigmas.append(found.sigma)
        times.append(found.time_frames)
    held(sigmas, 3)
    held(times, 8)
    assert fit_level(np.random.default_rng(0).normal(0, 1, 100), 0.01).time_frames is None


def test_no_level_lies_in_the_interval_of_one_that_is_not_there() -> None:
    """At its rate, 19 of 20; a level of twice what is known beside it is seen each time."""
    none = seen = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        known = 100 + rng.normal(0, 0.1, 80)
        none += fit_level(known, 0.01).sigma.low == 0
        seen += 0 < fit_level(known + rng.normal(0, 0.2, 80), 0.01).sigma.low <= 0.2
    assert none >= 35
    assert seen >= 37


def test_a_level_slower_than_the_series_is_long_lies_below_its_upper_end() -> None:
    """Time constants of the series' length, of three times and of ten times of it, 100 frames."""
    for time_frames in (100, 300, 1000):
        found = []
        for seed in range(20):
            rng = np.random.default_rng(seed)
            level = fit_level(3 * wandering(rng, 100, time_frames) + rng.normal(0, 0.05, 100), 0.0025)
            found.append(level.sigma)
        held(found, 3, widest=6.6)


def test_a_level_is_told_over_gaps_in_time() -> None:
    """Five frames of each six are missing: a time constant of 90 frames of the camera is 15 of those that are there."""
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        level = fit_level(wandering(rng, 360, 90)[::6] + rng.normal(0, 0.05, 60), 0.0025, np.arange(0, 360, 6))
        assert level.time_frames is not None
        found.append(level.time_frames)
    held(found, 90)
    assert max(time.value for time in found) > 60


def test_pixels_that_remember_make_no_level_that_is_not_there() -> None:
    """Their mean wanders by 0.06 of their sigma, in 32 x 32 px a time constant of 4.5 frames."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        frames = np.stack([wandering(rng, 100, 4.5) for _ in range(32 * 32)], axis=1).reshape(100, 32, 32)
        report = measure_noise(100 + frames + rng.normal(0, 0.5, frames.shape), 30.0, Region(0, 0, 32, 32))
        assert report.temporal.memory is not None
        assert report.level.sigma.low == 0
        assert report.level.time_frames is None


def test_what_pixels_that_remember_may_make_up_is_no_level_s_lower_end() -> None:
    """A white level of 0.25 beside pixels whose mean wanders by 0.06; and none beside others."""
    found = []
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        frames = np.stack([wandering(rng, 100, 4.5) for _ in range(24 * 24)], axis=1).reshape(100, 24, 24)
        frames += rng.normal(0, 1, frames.shape)
        assert measure_noise(100 + frames, 30.0, Region(0, 0, 24, 24)).level.sigma.low == 0
        frames += rng.normal(0, 0.25, (100, 1, 1))
        found.append(measure_noise(100 + frames, 30.0, Region(0, 0, 24, 24)).level.sigma)
    held(found, 0.25, widest=0.9)
    assert all(level.low > 0.1 and level.high < 0.45 for level in found)


def test_pixels_that_walk_make_no_level_that_is_not_there() -> None:
    """By 5 in a second, each of 24 x 24: their mean is off by 0.3 after two."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        walks = rng.normal(0, 5 / math.sqrt(30), (60, 24, 24)).cumsum(axis=0)
        report = measure_noise(100 + walks + rng.normal(0, 2, walks.shape), 30.0, Region(0, 0, 24, 24))
        assert report.temporal.memory is not None
        assert report.temporal.memory.told_walk is not None
        assert report.level.time_frames is None


def test_a_level_that_wanders_is_told_in_frames_of_the_camera() -> None:
    """Each frame is recorded twice: nothing changes but the rate of the recording."""
    rng = np.random.default_rng(1)
    level = 0.5 * wandering(rng, 80, 60)[:, None, None]
    frames = np.rint(1000 + rng.normal(0, 4, (80, 32, 32)) + 20 * level)
    notes = [
        [text for _, text in noise_lines(report) if "wanders" in text]
        for report in (measure_noise(frames, 30.0), measure_noise(np.repeat(frames, 2, axis=0), 60.0))
    ]
    assert notes[0]
    assert notes[0] == notes[1]


def test_a_fit_tells_the_memory_of_the_level() -> None:
    scene = irsim.loads(
        "{frames: 120, camera: {size: [64, 48], noise: [{kind: white, ratio: 1}, "
        "{kind: ar1, over: frame, ratio: 1, time_constant_s: 0.3}]}, background: {kind: ground, spread_k: 0}}"
    )
    told = [text for _, text in irsim.fit(scene).summary() if "level" in text]
    assert len(told) == 1
    assert told[0].startswith("level ")
    assert "with a memory of" in told[0]


def test_the_term_of_time_is_the_level_s_however_slow_it_is() -> None:
    found = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        level = 0.5 * wandering(rng, 60, 180)[:, None, None]
        found.append(measure_noise(100 + rng.normal(0, 1, (60, 32, 32)) + level, 30.0, Region(0, 0, 32, 32)).terms.t)
    held(found, 0.5, widest=3.7)


@pytest.mark.parametrize("number", [np.arange(12), np.array([0, 1, 4, 5, 6, 11, 12, 13, 20, 21, 22, 30])])
def test_the_likelihood_is_that_of_the_whole_covariance(number: np.ndarray) -> None:
    """Harville (1974): -1/2 (log |V| + log |X' V^-1 X| - log |X' X| + y' P y), X a column of ones and
    P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1; frames that were left out lie between."""
    series, ones = 7000 + np.random.default_rng(3).normal(0, 2, 12), np.ones(12)
    sigmas, times, known = np.array([0.1, 1.0, 8.0]), np.array([1.0, 5.0, 40.0]), 0.3
    found = _likelihood(series, np.exp(-np.diff(number)[:, None] / times), sigmas, known)
    for row, time in enumerate(times):
        for column, sigma in enumerate(sigmas):
            apart = np.abs(np.subtract.outer(number, number))
            covariance = sigma**2 * np.exp(-apart / time) + known * np.eye(12)
            inverse = np.linalg.inv(covariance)
            weight = ones @ inverse @ ones
            left = series - (ones @ inverse @ series) / weight
            entropy = np.linalg.slogdet(covariance)[1] + np.log(weight) - np.log(12)
            assert found[row, column] == pytest.approx(-0.5 * (entropy + left @ inverse @ left), rel=1e-9)
