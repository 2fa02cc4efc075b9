"""Intervals of irsim.calibration hold the true value in 95 % of many recordings of the camera presets."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
from calibration_clips import noise_frames, rendered
from intervals import held

import irsim
from irsim.calibration import CLASSES, NoiseReport, compare_texture, measure_noise, texture_figures
from irsim.calibration.background import background_pictures
from irsim.calibration.fit import fit
from irsim.config.yaml_text import read_yaml
from irsim.scenario.catalog import examples

EVEN = "frames: 60\ncamera: {preset: PRESET, size: [96, 80]}\nbackground: {kind: ground, spread_k: 0, mean_k: 290}\n"
SCENE = "frames: 100\ncamera: {preset: PRESET, size: [160, 128]}\nbackground: {kind: ground, spread_k: SPREAD}\n"
COOLED = {"vh": 0.3, "h": 0.15, "v": 0.08}
PRESETS = {
    "cooled_mwir": {**COOLED, "t": 0.15},
    "cooled_lwir": {**COOLED, "t": 0.2},
    "uncooled_lwir": {"vh": 0.5, "tvh": 1.0},
}
"""Ratios of the presets, in units of the NETD."""
CLAIMS = {name: read_yaml(path).value.get("like") for name, path in examples().items()}


@lru_cache
def reports(preset: str) -> tuple[NoiseReport, ...]:
    return tuple(measure_noise(rendered(EVEN.replace("PRESET", preset), seed), 50.0) for seed in range(24))


@pytest.mark.parametrize(("preset", "term"), [(preset, term) for preset, ratios in PRESETS.items() for term in ratios])
def test_terms_of_presets_lie_in_their_intervals(preset: str, term: str) -> None:
    response = irsim.loads(EVEN.replace("PRESET", preset)).camera.response()
    netd = response.noise / response.gain
    rounding = 1 / 12 if term == "tvh" else 0.0
    true = math.sqrt((PRESETS[preset][term] * netd) ** 2 + rounding)
    held([getattr(report.terms, term) for report in reports(preset)], true)


@pytest.mark.parametrize(("count", "rho"), [(60, 0.6), (60, 0.9), (300, 0.97)])
def test_correlated_noise_lies_in_its_intervals(count: int, rho: float) -> None:
    sigmas = {"tvh": 3.0, "vh": 2.0, "correlated": 4.0, "rho": rho}
    frames = [noise_frames(seed, (count, 48, 48), **sigmas) for seed in range(24)]
    found = [measure_noise(each, 30.0, (0, 0, 48, 48)) for each in frames]
    memories = [report.temporal.memory for report in found if report.temporal.memory is not None]
    assert len(memories) == 24
    held([memory.correlated for memory in memories], 4.0)
    held([memory.white for memory in memories], 3.0)
    held([memory.rho for memory in memories], rho)
    held([report.terms.vh for report in found], 2.0)


@pytest.mark.parametrize("preset", ["cooled_mwir", "cooled_lwir", "uncooled_lwir"])
@pytest.mark.parametrize("spread", ["0", "1"])
def test_rendered_and_fitted_again_the_figures_agree(preset: str, spread: str) -> None:
    first = fit(irsim.loads(SCENE.replace("PRESET", preset).replace("SPREAD", spread)))
    again = dict(fit(first.scenario).figures.estimates())
    for name, found in first.figures.estimates():
        if not name.startswith(("flaws.", "rows.", "columns.")):
            assert found.low <= again[name].high, name
            assert again[name].low <= found.high, name


@pytest.mark.parametrize("name", [name for name, like in CLAIMS.items() if like])
def test_shipped_scenes_look_like_their_claim(name: str) -> None:
    found = texture_figures(background_pictures(irsim.open_source(name), 9))
    assert set(compare_texture(found).fitting) == {CLAIMS[name]}


@pytest.mark.parametrize("name", ["sky", "clouds", "ground", "treeline", "countryside"])
def test_over_seeds_a_scene_lies_within_real_recordings(name: str) -> None:
    """The median of ten seeds, in ranges that are not widened."""
    seeds = [background_pictures(irsim.open_source(name, seed=seed), 2) for seed in range(1, 11)]
    found = texture_figures(np.concatenate(seeds))
    real_ranges = CLASSES[str(CLAIMS[name])]
    for figure in set(real_ranges.ranges()) - {"bend"}:
        low, high = getattr(real_ranges, figure)
        assert low <= getattr(found, figure) <= high, figure
