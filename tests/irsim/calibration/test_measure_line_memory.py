"""What frames, rows and columns have in common is told with its memory; memory beside slow drift is held."""

from __future__ import annotations

import math

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.measure import Region, measure_noise, noise_lines
from irsim.types import Floats

FRAMES, SIDE, SIGMA = 60, 48, 10.0
WHOLE = Region(0, 0, SIDE, SIDE)
AXES = {"t": (FRAMES, 1, 1), "tv": (FRAMES, SIDE, 1), "th": (FRAMES, 1, SIDE)}


def series(rng: np.random.Generator, shape: tuple[int, ...], rho: float) -> Floats:
    """AR(1) noise of sigma 1 along the first axis."""
    drawn = rng.standard_normal(shape)
    for k in range(1, len(drawn)):
        drawn[k] = rho * drawn[k - 1] + math.sqrt(1 - rho**2) * drawn[k]
    return drawn


@pytest.mark.sampled
@pytest.mark.parametrize("term", AXES)
@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_a_term_that_remembers_is_told_and_no_other(term: str, rho: float) -> None:
    told = inside = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        frames = 1000 + SIGMA * rng.standard_normal((FRAMES, SIDE, SIDE)) + 5 * series(rng, AXES[term], rho)
        report = measure_noise(frames, 30.0, WHOLE)
        labels = [label for label, _ in noise_lines(report)]
        assert set(report.lines) <= {term}
        assert [label for label in labels if label in LABELS.values()] == [LABELS[each] for each in report.lines]
        told += report.level.time_frames is not None if term == "t" else term in report.lines
        sigma = getattr(report.terms, term)
        inside += sigma.low < 5 < sigma.high
    assert told == (5 if rho else 0)
    assert inside >= 4


LABELS = {"tv": "rows", "th": "columns"}


@pytest.mark.slow
@pytest.mark.parametrize(("term", "stays"), [("tv", "v"), ("th", "h")])
def test_what_lines_are_made_of_lies_in_its_intervals(term: str, stays: str) -> None:
    """White, AR(1) and fixed, beside pixels that remember, too; 20 recordings each."""
    true = {"white": 0.3, "correlated": 0.8, "total": math.hypot(0.3, 0.8), "rho": 0.9, "fixed": 0.6}
    inside = dict.fromkeys((*true, "walk", "term", "stays"), 0)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        pixels = series(rng, (FRAMES, SIDE, SIDE), 0.8) + rng.standard_normal((SIDE, SIDE))
        lines = 0.8 * series(rng, AXES[term], 0.9) + 0.3 * rng.standard_normal(AXES[term])
        fixed = 0.6 * rng.standard_normal((1, *AXES[term][1:]))
        report = measure_noise(100 + pixels + lines + fixed, 30.0, WHOLE)
        memory = report.lines[term]
        for name, value in true.items():
            inside[name] += getattr(memory, name).low <= value <= getattr(memory, name).high
        inside["walk"] += memory.walk.low == 0
        inside["term"] += getattr(report.terms, term) == memory.total
        inside["stays"] += getattr(report.terms, stays) == memory.fixed
    assert min(inside.values()) >= 16, inside


@pytest.mark.sampled
@pytest.mark.parametrize("term", ["tv", "th"])
def test_lines_that_remember_make_no_level(term: str) -> None:
    inside = levels = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        frames = 100 + rng.standard_normal((FRAMES, SIDE, SIDE)) + 0.8 * series(rng, AXES[term], 0.9)
        report = measure_noise(frames, 30.0, WHOLE)
        inside += report.terms.t.low == 0
        levels += report.level.time_frames is not None or report.level.sigma.low > 0
    assert inside >= 10
    assert levels <= 2


def test_lines_that_drift_are_told() -> None:
    """By a walk of 0.1 a frame: 0.1 sqrt(30) in a second."""
    held_ = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        walk = 0.1 * rng.standard_normal(AXES["th"]).cumsum(axis=0)
        report = measure_noise(100 + rng.standard_normal((FRAMES, SIDE, SIDE)) + walk, 30.0, WHOLE)
        found = report.lines["th"].walk
        held_ += found.low <= 0.1 * math.sqrt(30) <= found.high
    assert held_ >= 4


def test_memory_of_pixels_is_not_taken_for_that_of_rows() -> None:
    """The mean of a row remembers as its pixels do."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        frames = 1000 + SIGMA * series(rng, (FRAMES, SIDE, SIDE), 0.9) + 0.3 * rng.standard_normal(AXES["tv"])
        assert measure_noise(frames, 30.0, WHOLE).lines == {}


@pytest.mark.slow
@pytest.mark.parametrize("without", ["", "drift"])
def test_memory_beside_a_slow_drift_lies_in_its_intervals(without: str) -> None:
    """The uncooled preset: pixels drift by 2.5 NETD in two minutes, five seconds of which are seen."""
    rhos, correlated, total = [], [], []
    for seed in range(8):
        scene = irsim.loads(
            f"{{frames: 150, seed: {seed}, camera: {{preset: uncooled_lwir, size: [128, 96]}}, "
            f"background: {{kind: ground, spread_k: 0, mean_k: 300}}, without: [{without}]}}"
        )
        report = measure_noise(np.stack([frame.image for frame in irsim.Rendering(scene).frames()]), 30.0)
        memory = report.temporal.memory
        assert memory is not None
        rhos.append(memory.rho)
        correlated.append(memory.correlated)
        total.append(memory.total)
    netd = scene.camera.response().noise
    held(rhos, math.exp(-1 / 31.5))
    held(correlated, 0.8 * netd)
    held(total, math.hypot(netd, 12**-0.5))
