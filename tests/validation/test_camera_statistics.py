"""Long statistics of the camera: variance over seeds, and the figures measured on real cameras.

The figures are those of flat patches of raw recordings: a corrected cooled LWIR camera, an uncorrected cooled MWIR one,
and a Lepton 3.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from irsim.camera.bloom import Bloom
from irsim.camera.drift import Drift
from irsim.camera.noise import Shot
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.scenario.loader import loads
from irsim.types import Floats

FLAT = "background: {kind: sky, horizon_k: 300, zenith_k: 300}\n"


def rendered(text: str, count: int, *overrides: str) -> Floats:
    """Return the counts of frames 0 to count - 1 of an even scene, (count, rows, columns) float64."""
    renderer = Renderer(loads(f"frames: {count}\n{FLAT}{text}", overrides=list(overrides)))
    return np.stack([renderer.frame(index)[0].image for index in range(count)]).astype(np.float64)


def netd_for(text: str, counts: float) -> str:
    """Return the override of the NETD, 100 mK in the text, at which one NETD is so many counts."""
    return f"camera.netd_mk={counts / loads(FLAT + text).camera.response().noise * 100}"


@pytest.mark.parametrize("along", ["columns", "rows", "around"])
def test_variance_of_spilled_charge_is_that_over_seeds(along: Any) -> None:
    """Spill ends within the picture, or half-fills single pixels. At its very end few of 600 draws reach a pixel: the
    median is compared."""
    band = (3.4, 4.9)
    response = ElectronSensor().response(SensorSettings(band, 14, 0.0, (220.0, 400.0)))
    drift = Drift(pixel=0, column=0, row=0, gain=0.02, age_s=1e5)
    chain = SignalChain(response, (Shot(), drift), 30.0, 1, bloom=Bloom(along=along, length_px=1.5))
    flat = np.full((36, 36), radiance(band, 300.0), np.float32)
    light = flat.copy()
    light[11:13, 11:13], light[23:25, 23:25] = radiance(band, 400.0), radiance(band, 440.0)
    mean, variance = chain.mean(light, 3), chain.variance(light, 3)
    counts = [replace(chain, seed=seed).expose(light, 3).astype(np.float64) for seed in range(600)]
    square = np.mean([(each - mean) ** 2 for each in counts], axis=0)
    receiving = np.isfinite(variance) & (variance > 1.3 * replace(chain, bloom=None).variance(flat, 3))
    assert receiving.sum() >= 2
    assert np.median(square[receiving] / variance[receiving]) == pytest.approx(1, abs=0.1)
    elsewhere = np.isfinite(variance) & ~receiving
    assert (square[elsewhere] / variance[elsewhere]).mean() == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize(("preset", "mean", "median"), [("cooled_mwir", 0.03, 0.05), ("uncooled_lwir", 0.15, 0.2)])
def test_variance_of_a_scenario_is_that_over_seeds(preset: str, mean: float, median: float) -> None:
    """The frame's level is one draw a scene: its mean square over 300 is known to sqrt(2 / 300) = 8 %."""
    text = "frames: 4\nbackground: {kind: sky, horizon_k: 300, zenith_k: 280}\n"
    netd = ", netd_mk: 200" if preset == "uncooled_lwir" else ""  # well above a count
    scenario = loads(f"{text}camera: {{preset: {preset}, size: [32, 24]{netd}}}", overrides=["without=[bad_pixels]"])
    renderer = Renderer(scenario)
    expected = renderer.sensor.mean(renderer.light(3), 3)
    frames = (Renderer(scenario.model_copy(update={"seed": seed})).frame(3)[0].image for seed in range(300))
    squares = np.mean([(image - expected) ** 2.0 for image in frames], axis=0)
    variance = renderer.variance(3)
    assert squares.mean() == pytest.approx(variance.mean(), rel=mean)
    assert np.median(squares / variance) == pytest.approx(1, rel=median)


def test_drift_variance_grows_after_a_correction() -> None:
    """1 - exp(-2 age / time constant) of its final value."""
    drift = "{kind: drift, pixel: 2, column: 0, row: 0, time_constant_s: 30}"
    text = "frames: 4000\nbackground: {kind: sky, horizon_k: 280, zenith_k: 280}\ncamera: {size: [160, 128], "
    text += f"netd_mk: 500, noise: [{drift}], correction: {{frames: [2000]}}}}"
    renderer = Renderer(loads(text))
    clean = Renderer(loads(text, overrides=["without=[drift]"])).frame(0)[0].image.astype(float)
    for index in (0, 30, 300, 1500, 1999, 2000, 2030, 3500):
        age = index - (2000 if index >= 2000 else 0)
        grown = 1 - math.exp(-2 * age / (30 * 30))
        expected = (2 * renderer.sensor.response.noise) ** 2 * grown + (1 / 12 if age else 0)
        assert (renderer.frame(index)[0].image - clean).var() == pytest.approx(expected, rel=0.05, abs=0.12), index


def test_a_corrected_cooled_camera_has_measured_figures() -> None:
    """LWIR, corrected: pair 1.75 (of white 1.65 and lines), fixed pixel 0.66, column 0.14, row 0.20, drift 0.35."""
    text = "camera: {size: [256, 192], band: lwir, netd_mk: 100, range_k: [250, 350], noise: [{kind: noise_3d, "
    text += "t: 0.212, tv: 0.25, th: 0.25, tvh: 1, vh: 0.4, h: 0.085, v: 0.121}]}"
    seen = rendered(text, 300, netd_for(text, 1.65))
    assert np.diff(seen, axis=0).std() / math.sqrt(2) == pytest.approx(1.75, rel=0.05)
    assert seen.mean(axis=(1, 2)).std() == pytest.approx(0.35, rel=0.15)
    changing = (seen - seen.mean(axis=0)).reshape(300, -1)
    assert abs((changing[1:] * changing[:-1]).mean() / changing.var()) < 0.03
    flat = seen.mean(axis=0)
    rows, columns = flat.mean(axis=1, keepdims=True), flat.mean(axis=0)
    assert rows.std() == pytest.approx(0.20, rel=0.2)
    assert columns.std() == pytest.approx(math.hypot(0.14, 0.66 / math.sqrt(192)), rel=0.2)
    assert (flat - rows - columns).std() == pytest.approx(math.hypot(0.66, 1.68 / math.sqrt(300)), rel=0.03)


def test_an_uncorrected_cooled_camera_has_measured_figures() -> None:
    """MWIR, uncorrected: temporal 3.9 (white), fixed pixel 16, column 3, row 52 by odd and even rows, counts."""
    fixed = "{kind: fixed_pattern, pixel: 4.10, column: 0.77, row: 1}, {kind: odd_even, ratio: 13.3}"
    text = f"camera: {{size: [256, 192], netd_mk: 100, range_k: [220, 400], noise: [{{kind: white}}, {fixed}]}}"
    seen = rendered(text, 40, netd_for(text, 3.9))
    assert np.diff(seen, axis=0).std() / math.sqrt(2) == pytest.approx(3.9, rel=0.02)
    flat = seen.mean(axis=0)
    rows, columns = flat.mean(axis=1), flat.mean(axis=0)
    assert rows.std() == pytest.approx(52, rel=0.03)
    assert columns.std() == pytest.approx(math.hypot(3, 16 / math.sqrt(192)), rel=0.1)
    assert (flat - rows[:, None] - columns).std() == pytest.approx(math.hypot(16, 3.9 / math.sqrt(40)), rel=0.02)


def test_ar1_noise_has_the_differences_of_a_lepton() -> None:
    """Sigma of differences at lags 1, 2, 3, 5, 9, 18, 36 of a Lepton 3: 0.51 ... 1.58; AR(1) of rho 0.9, sigma 1.13."""
    text = "camera: {size: [80, 60], rate_hz: 9, band: lwir, bits: 16, range_k: [250, 350], netd_mk: 10, "
    text += "noise: [{kind: ar1, rho: 0.9}]}"
    seen = rendered(text, 500) / (loads(FLAT + text).camera.response().noise / 1.13)
    measured = {1: 0.51, 2: 0.70, 3: 0.84, 5: 1.03, 9: 1.24, 18: 1.44, 36: 1.58}
    for lag, sigma in measured.items():
        assert (seen[lag:] - seen[:-lag]).std() == pytest.approx(sigma, abs=0.04), lag


def test_the_uncooled_preset_drifts_as_a_lepton() -> None:
    """Lepton 3, eight clips: fixed pixel 2.5-6.4, column 0.6-1.4, row 0.4-1.3, frame drift 0.8-17, rho 0.74-0.89.

    A clip begins two minutes after a correction; one NETD are 1.65 counts.
    """
    text = "camera: {preset: uncooled_lwir, size: [160, 120], rate_hz: 9}"
    seen = rendered(text, 400, "without=[bad_pixels]", "camera.noise.drift.age_s=120")
    seen *= 1.65 / loads(FLAT + text).camera.response().noise
    flat = seen.mean(axis=0)
    rows, columns = flat.mean(axis=1), flat.mean(axis=0)
    assert 2.5 < (flat - rows[:, None] - columns).std() < 6.4
    assert 0.6 < columns.std() < 1.4
    assert 0.4 < rows.std() < 1.3
    assert 0.8 < seen.mean(axis=(1, 2)).std() < 17
    changing = (seen - flat).reshape(400, -1)
    assert 0.7 < (changing[1:] * changing[:-1]).mean() / changing.var() < 0.9


def test_blinking_pixels_give_heavy_tails() -> None:
    """Kurtosis over the frame of the difference of frames: 216 in a real cooled camera, 3 in a clean patch."""
    text = "camera: {size: [320, 240], noise: [{kind: white}, {kind: bad_pixels, blinking: 0.002, dead: 0, hot: 0}]}"
    for overrides, low, high in (((), 60, 400), (("without=[bad_pixels]",), 2.9, 3.1)):
        seen = rendered(text, 46, *overrides)
        difference = seen[45] - seen[0]
        assert low < (difference**4).mean() / (difference**2).mean() ** 2 < high
