"""Noise terms, correlation over time and the level of known noise lie in their intervals; notes name the limits."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from calibration_clips import noise_frames, rendered, series
from intervals import held

from irsim.calibration import measure_noise, noise_3d, temporal_noise
from irsim.calibration.level import fit_level
from irsim.calibration.report import noise_lines, noise_notes
from irsim.calibration.temporal import time_freedom

TERMS = {"t": 1.0, "v": 2.0, "h": 3.0, "tv": 0.5, "th": 0.8, "vh": 4.0, "tvh": 5.0}
EVEN = "frames: {frames}\ncamera: {{preset: {preset}, size: [96, 80]}}\nbackground: {{kind: ground, spread_k: 0}}\n"
SEEDS = range(4)


def test_the_seven_terms_lie_in_their_intervals() -> None:
    found = [noise_3d(noise_frames(seed, (60, 48, 48), **TERMS)) for seed in range(8)]
    for term, true in TERMS.items():
        held([getattr(each, term) for each in found], true)
    white = noise_3d(noise_frames(1, tvh=5.0))
    assert all(getattr(white, term).low == 0 for term in TERMS if term != "tvh")


@pytest.mark.parametrize(("rho", "count"), [(0.8, 60), (0.9, 120)])
def test_white_and_correlated_noise_are_separated(rho: float, count: int) -> None:
    frames = [noise_frames(seed, (count, 48, 48), tvh=3.0, vh=2.0, correlated=4.0, rho=rho) for seed in SEEDS]
    memories = [temporal_noise(each, 30.0).memory for each in frames]
    assert None not in memories
    found = [memory for memory in memories if memory is not None]
    held([each.white for each in found], 3.0, widest=0.2)
    held([each.correlated for each in found], 4.0, widest=0.3)
    held([each.total for each in found], 5.0)
    held([each.rho for each in found], rho, widest=0.1)
    held([each.fixed for each in found], 2.0)
    assert sum(each.drift is None for each in found) >= 3


def test_drift_is_separated_from_correlated_noise() -> None:
    """A walk of 0.1 counts a frame, sqrt(30) as much a second, with white and AR(1) noise."""
    found = []
    for seed in SEEDS:
        walk = np.random.default_rng(seed + 100).normal(0, 0.1, (150, 48, 48)).cumsum(axis=0)
        frames = walk + noise_frames(seed, (150, 48, 48), tvh=1.0, correlated=1.0, rho=0.7)
        found.append(temporal_noise(frames, 30.0).memory)
    memories = [memory for memory in found if memory is not None]
    held([memory.walk for memory in memories], 0.1 * math.sqrt(30), widest=0.2)
    held([memory.correlated for memory in memories], 1.0)


def test_lost_frames_count_as_time() -> None:
    """Every third frame is missing; correlation over the gap is rho squared."""
    number = np.array([k for k in range(240) if k % 3 != 2])
    frames = noise_frames(3, (240, 48, 48), tvh=1.0, correlated=3.0, rho=0.9)[number]
    memory = temporal_noise(frames, 30.0, number).memory
    assert memory is not None
    assert memory.rho.value == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_the_level_lies_in_its_interval(rho: float) -> None:
    number = np.arange(100)
    found = [fit_level(series(np.random.default_rng(seed), (100,), 2.0, rho), 0.01, number) for seed in range(8)]
    held([each.sigma for each in found], 2.0)
    assert sum((each.time_frames is None) == (rho == 0) for each in found) >= 7


def test_correlation_reduces_degrees_of_freedom() -> None:
    number = np.arange(100)
    memory = temporal_noise(noise_frames(1, (100, 48, 48), correlated=3.0, rho=0.9), 30.0).memory
    assert time_freedom(None, number) == 99
    assert 5 < time_freedom(memory, number) < 30


@pytest.mark.parametrize("preset", ["cooled_mwir", "uncooled_lwir"])
def test_presets_have_the_noise_of_their_kind(preset: str) -> None:
    report = measure_noise(rendered(EVEN.format(frames=100, preset=preset)), 50.0)
    assert (report.temporal.memory is not None) == (preset == "uncooled_lwir")
    assert report.doubtful == ()
    assert not report.moving
    assert not report.slides
    assert report.terms.vh.value > 0


def test_correlated_rows() -> None:
    rng = np.random.default_rng(5)
    rows = series(rng, (150, 64, 1), 2.0, 0.8)
    report = measure_noise(noise_frames(5, (150, 64, 64), tvh=3.0, v=1.0) + rows, 30.0, (0, 0, 64, 64))
    assert set(report.lines) == {"tv"}
    memory = report.lines["tv"]
    assert memory.total.low <= 2.0 <= memory.total.high
    assert memory.rho.low <= 0.8 <= memory.rho.high
    assert report.terms.tv == memory.total


def test_with_motion_sharp_noise_alone_is_measured() -> None:
    rng = np.random.default_rng(1)
    x, y, k = np.arange(64), np.arange(64)[:, None], np.arange(40)[:, None, None]
    wave = 30 * np.sin(x / 5 + y / 9 + k / 2)
    report = measure_noise(wave + rng.normal(1000, 2, (40, 64, 64)), 30.0, (0, 0, 64, 64))
    assert report.moving
    assert report.fine == pytest.approx(2.0, rel=0.1)
    assert set(TERMS) <= set(report.doubtful)
    assert any("moves" in note for note in noise_notes(report))


def test_a_scene_in_the_region_is_noted() -> None:
    y, x = np.mgrid[:64, :64]
    scene = 20 * np.sin(x / 6) * np.cos(y / 7)
    report = measure_noise(scene + noise_frames(1, (20, 64, 64), tvh=2.0), 30.0, (0, 0, 64, 64))
    assert report.doubtful == ("v", "h", "vh")
    assert not report.together
    assert any("may contain the scene" in text for label, text in noise_lines(report) if label == "vh")


def test_rounding_and_clipping_are_noted() -> None:
    rng = np.random.default_rng(2)
    quiet = measure_noise(rng.normal(100.3, 0.1, (30, 48, 48)).round().astype(np.uint16), 30.0)
    assert quiet.rounded
    dark = measure_noise(rng.normal(0, 5, (30, 48, 48)).clip(0).round().astype(np.uint16), 30.0)
    assert dark.clipped > 0.3
    assert any("clipped" in note for note in noise_notes(dark))


def test_the_input_is_not_changed_and_json_holds_plain_values() -> None:
    frames = noise_frames(1, (20, 40, 40), tvh=2.0).round().astype(np.uint16)
    before = frames.copy()
    report = measure_noise(frames, 30.0)
    np.testing.assert_array_equal(frames, before)
    assert json.loads(json.dumps(report.as_json()))["terms"]["tvh"]["value"] == report.terms.tvh.value
