"""What real cameras measure, in counts: the noise terms reproduce it. The figures are those of flat patches of
raw recordings: a corrected cooled LWIR camera, an uncorrected cooled MWIR one, and a Lepton 3.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from irsim.render.frame import Renderer
from irsim.scenario.loader import loads


def test_corrected_cooled_camera_has_the_figures_of_a_real_one() -> None:
    """LWIR, corrected: pair 1.75 (of white 1.65 and lines), fixed pixel 0.66, column 0.14, row 0.20, drift 0.35."""
    text = """
frames: 300
camera:
  size: [256, 192]
  band: lwir
  netd_mk: 100
  range_k: [250, 350]
  noise:
    - {kind: noise_3d, t: 0.212, tv: 0.25, th: 0.25, tvh: 1, vh: 0.4, h: 0.085, v: 0.121}
background: {kind: sky, horizon_k: 300, zenith_k: 300}
"""
    netd = 1.65 / loads(text).camera.response().noise * 100
    renderer = Renderer(loads(text, overrides=[f"camera.netd_mk={netd}"]))
    seen = np.stack([renderer.frame(index)[0].image for index in range(300)]).astype(float)
    assert np.diff(seen, axis=0).std() / math.sqrt(2) == pytest.approx(1.75, rel=0.05)
    levels = seen.mean(axis=(1, 2))
    assert levels.std() == pytest.approx(0.35, rel=0.15)
    changing = (seen - seen.mean(axis=0)).reshape(300, -1)
    assert abs((changing[1:] * changing[:-1]).mean() / changing.var()) < 0.03
    flat = seen.mean(axis=0)
    rows, columns = flat.mean(axis=1, keepdims=True), flat.mean(axis=0)
    assert rows.std() == pytest.approx(0.20, rel=0.2)
    assert columns.std() == pytest.approx(math.hypot(0.14, 0.66 / math.sqrt(192)), rel=0.2)
    assert (flat - rows - columns).std() == pytest.approx(math.hypot(0.66, 1.68 / math.sqrt(300)), rel=0.03)


def test_cooled_camera_without_correction_has_the_figures_of_a_real_one() -> None:
    """MWIR, uncorrected: temporal 3.9 (white), fixed pixel 16, column 3, row 52 by odd and even rows, counts."""
    fixed = "{kind: fixed_pattern, pixel: 4.10, column: 0.77, row: 1}"
    text = f"""
frames: 40
camera:
  size: [256, 192]
  netd_mk: 100
  range_k: [220, 400]
  noise: [{{kind: white}}, {fixed}, {{kind: odd_even, ratio: 13.3}}]
background: {{kind: sky, horizon_k: 300, zenith_k: 300}}
"""
    scenario = loads(text)
    unit = scenario.camera.response().noise
    netd = 3.9 / unit * 100
    renderer = Renderer(loads(text, overrides=[f"camera.netd_mk={netd}"]))
    seen = np.stack([renderer.frame(index)[0].image for index in range(40)]).astype(float)
    pairs = np.diff(seen, axis=0).std() / math.sqrt(2)
    assert pairs == pytest.approx(3.9, rel=0.02)
    flat = seen.mean(axis=0)
    rows, columns = flat.mean(axis=1), flat.mean(axis=0)
    assert rows.std() == pytest.approx(52, rel=0.03)
    assert columns.std() == pytest.approx(math.hypot(3, 16 / math.sqrt(192)), rel=0.1)
    assert (flat - rows[:, None] - columns).std() == pytest.approx(math.hypot(16, 3.9 / math.sqrt(40)), rel=0.02)


def test_uncooled_noise_has_the_differences_of_a_real_lepton() -> None:
    """Sigma of differences at lags 1, 2, 3, 5, 9, 18, 36 of a Lepton 3: 0.51 ... 1.58; AR(1) of rho 0.9, sigma 1.13."""
    text = """
frames: 500
camera:
  size: [80, 60]
  rate_hz: 9
  band: lwir
  bits: 16
  range_k: [250, 350]
  netd_mk: 10
  noise: [{kind: ar1, rho: 0.9}]
background: {kind: sky, horizon_k: 300, zenith_k: 300}
"""
    scenario = loads(text)
    renderer = Renderer(scenario)
    unit = scenario.camera.response().noise / 1.13
    seen = np.stack([renderer.frame(index)[0].image for index in range(500)]).astype(np.float64) / unit
    measured = {1: 0.51, 2: 0.70, 3: 0.84, 5: 1.03, 9: 1.24, 18: 1.44, 36: 1.58}
    for lag, sigma in measured.items():
        assert (seen[lag:] - seen[:-lag]).std() == pytest.approx(sigma, abs=0.04), lag


def test_an_uncooled_camera_drifts_as_a_real_lepton_does() -> None:
    """Lepton 3, eight clips: fixed pixel 2.5-6.4, column 0.6-1.4, row 0.4-1.3, frame drift 0.8-17, rho 0.74-0.89.

    A clip begins two minutes after a correction; one NETD are 1.65 counts.
    """
    text = """
frames: 400
camera:
  preset: uncooled_lwir
  size: [160, 120]
  rate_hz: 9
background: {kind: sky, horizon_k: 300, zenith_k: 300}
"""
    renderer = Renderer(loads(text, overrides=["without=[bad_pixels]", "camera.noise.drift.age_s=120"]))
    seen = np.stack([renderer.frame(index)[0].image for index in range(400)]).astype(np.float64)
    seen *= 1.65 / renderer.sensor.response.noise
    flat = seen.mean(axis=0)
    rows, columns = flat.mean(axis=1), flat.mean(axis=0)
    assert 2.5 < (flat - rows[:, None] - columns).std() < 6.4
    assert 0.6 < columns.std() < 1.4
    assert 0.4 < rows.std() < 1.3
    assert 0.8 < seen.mean(axis=(1, 2)).std() < 17
    changing = (seen - flat).reshape(400, -1)
    assert 0.7 < (changing[1:] * changing[:-1]).mean() / changing.var() < 0.9


def test_blinking_pixels_give_a_cooled_camera_heavy_tails() -> None:
    """Kurtosis over the frame of the difference of frames: 216 in a real cooled camera, 3 in a clean patch."""
    text = """
frames: 60
camera: {size: [320, 240], noise: [{kind: white}, {kind: bad_pixels, blinking: 0.002, dead: 0, hot: 0}]}
background: {kind: sky, horizon_k: 300, zenith_k: 300}
"""
    renderer = Renderer(loads(text))
    difference = renderer.frame(45)[0].image.astype(float) - renderer.frame(0)[0].image
    kurtosis = (difference**4).mean() / (difference**2).mean() ** 2
    assert 60 < kurtosis < 400
    clean = Renderer(loads(text, overrides=["without=[bad_pixels]"]))
    difference = clean.frame(45)[0].image.astype(float) - clean.frame(0)[0].image
    assert (difference**4).mean() / (difference**2).mean() ** 2 == pytest.approx(3, abs=0.1)
