"""What frames, rows and columns have in common is told where it remembers; memory beside slow drift is held."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_measure_fit import held

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


@pytest.mark.parametrize("term", AXES)
@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_a_term_that_remembers_is_told_and_no_other(term: str, rho: float) -> None:
    told = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        frames = 1000 + SIGMA * rng.standard_normal((FRAMES, SIDE, SIDE)) + 5 * series(rng, AXES[term], rho)
        report = measure_noise(frames, 30.0, WHOLE)
        told += term in report.remembered
        assert set(report.remembered) <= {term}
        notes = [text for label, text in noise_lines(report) if label == "note"]
        assert any(text.startswith(f"from one frame to the next {term} (") for text in notes) == bool(report.remembered)
    assert told == (5 if rho else 0)


def test_memory_of_pixels_is_not_taken_for_that_of_rows() -> None:
    """The mean of a row remembers as its pixels do."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        frames = 1000 + SIGMA * series(rng, (FRAMES, SIDE, SIDE), 0.9) + 0.3 * rng.standard_normal(AXES["tv"])
        assert measure_noise(frames, 30.0, WHOLE).remembered == {}


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
