"""Known texture, fixed pattern, PSF and background of pictures are measured within their intervals."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
from calibration_clips import noise_frames, rendered
from intervals import held
from scipy.special import ndtr

from irsim.calibration import Estimate
from irsim.calibration.background import background, mean_picture
from irsim.calibration.fixed_pattern import fixed_pattern, line_sigma, odd_even, remove_odd_even
from irsim.calibration.psf import fit_spot, point_blur
from irsim.calibration.selection import Region
from irsim.calibration.texture import fit_texture, grey_levels, periodogram
from irsim.geometry.random_fields import spectral
from irsim.types import Floats

SHAPE = (144, 168)
FIELD = {"beta_x": 2.6, "beta_y": 3.2, "correlation_px": 60.0, "stretch": 1.5, "spread": 10.0}
SHARP = Estimate(0.01, 0.01, 0.01)
POINT = """\
frames: 14
camera: {size: [160, 128], psf_px: PSF}
background: {kind: ground, spread_k: 0.3}
targets:
  - id: a
    shape: {kind: point, area_m2: 0.02, temperature_k: 700}
    path: {kind: straight, start: [20.3, 60.2], speed: 1.3, heading_deg: 10, range_m: 2000}
"""


@lru_cache
def field(seed: int, betas: tuple[float, float]) -> Floats:
    return np.asarray(spectral((1024, 1024), 3, betas, 60, 1.5, seed, "field")[: SHAPE[0], : SHAPE[1]])


def picture(seed: int, spread: float = 10.0, betas: tuple[float, float] = (2.6, 3.2)) -> Floats:
    """Return texture with white noise of sigma 0.5, rows of 0.3 and columns of 0.15."""
    rng = np.random.default_rng(seed)
    lined = spread * field(seed, betas) + rng.normal(0, 0.3, (SHAPE[0], 1)) + rng.normal(0, 0.15, (1, SHAPE[1]))
    return np.asarray(lined + rng.normal(0, 0.5, SHAPE))


def test_a_power_law_lies_in_its_intervals() -> None:
    spectra = [fit_texture(periodogram(picture(seed)), SHAPE, SHARP)[0] for seed in range(4)]
    for name, true in FIELD.items():
        held([getattr(spectrum.texture, name) for spectrum in spectra], true)
    held([spectrum.floor for spectrum in spectra], 0.25)


def test_rows_and_columns_lie_in_their_intervals_on_texture() -> None:
    pictures = [picture(seed) for seed in range(8)]
    held([line_sigma(each) for each in pictures], 0.3)
    held([line_sigma(each.T) for each in pictures], 0.15)
    without = [line_sigma(np.random.default_rng(seed).normal(0, 1, SHAPE)) for seed in range(8)]
    assert sum(each.low < 0.05 for each in without) >= 7
    assert max(each.high for each in without) < 0.3


def test_a_horizon_is_no_fixed_pattern() -> None:
    """Rows of 0.3 and a step of 300 counts across the picture."""
    found = [line_sigma(picture(seed) + 300 * (np.arange(SHAPE[0]) > 70)[:, None], True) for seed in range(8)]
    held(found, 0.3)


def test_noise_alone_is_no_texture() -> None:
    for seed in range(2):
        noise = np.random.default_rng(seed).normal(0, 2, (100, 120))
        spectrum, psf = fit_texture(periodogram(noise), (100, 120), None)
        assert spectrum.texture is None
        assert spectrum.floor.value == pytest.approx(4, rel=0.1)
        assert (psf.low, psf.high) == (0.4, 0.8)
        assert grey_levels(noise, spectrum) == ()


def test_grey_levels_that_are_not_gaussian_are_kept() -> None:
    even = picture(3, betas=(2.0, 2.0))
    spectrum, _ = fit_texture(periodogram(even), SHAPE, SHARP)
    assert grey_levels(even, spectrum) == ()
    skewed = np.exp(even / 8)
    levels = grey_levels(skewed, fit_texture(periodogram(skewed), SHAPE, SHARP)[0])
    assert len(levels) == 17
    assert list(levels) == sorted(levels)


def test_offset_of_odd_and_even_rows() -> None:
    striped = picture(1) + np.where(np.arange(SHAPE[0]) % 2, -2.0, 2.0)[:, None]
    found = odd_even(striped, 0)
    assert found.low <= 2 <= found.high
    evened = odd_even(remove_odd_even(striped, found.value, 0.0), 0)
    assert evened.value == pytest.approx(0, abs=1e-9)


def test_with_edges_the_floor_is_that_of_the_quietest_window() -> None:
    rng = np.random.default_rng(2)
    scene = picture(2, spread=0.0)
    scene[:, :84] += 50 * (rng.random((SHAPE[0], 84)) > 0.97)
    fixed = fixed_pattern(scene, SHARP, np.zeros(SHAPE, np.bool_))
    assert fixed.window is not None
    assert fixed.window.x >= 76
    assert fixed.floor.value == pytest.approx(0.25, rel=0.25)
    assert fixed_pattern(picture(2, spread=0.0), SHARP, np.zeros(SHAPE, np.bool_)).window is None


@pytest.mark.parametrize(("sigma", "major"), [(0.5, 0.5), (0.8, 0.8), (0.6, 1.1)])
def test_a_gaussian_spot_is_fitted(sigma: float, major: float) -> None:
    """Smear along x lies in the major axis."""
    edges = np.arange(12) - 0.5 - 5
    down, across = np.diff(ndtr((edges - 0.2) / sigma)), np.diff(ndtr((edges + 0.3) / major))
    spot = fit_spot(100 + 3000 * np.outer(down, across) + np.random.default_rng(1).normal(0, 1, (11, 11)))
    assert spot.is_point
    assert spot.minor == pytest.approx(sigma, rel=0.03)
    assert spot.major == pytest.approx(major, rel=0.04)


def test_bars_and_hot_pixels_are_no_points() -> None:
    bar = np.zeros((11, 11))
    bar[:, 4:7] = 500
    assert not fit_spot(bar).is_point
    pixel = np.zeros((11, 11))
    pixel[5, 5] = 500
    assert not fit_spot(pixel).is_point


@pytest.mark.parametrize("psf_px", [0.5, 1.2])
def test_psf_of_a_passing_point(psf_px: float) -> None:
    frames = rendered(POINT.replace("PSF", str(psf_px)))
    blur, still = point_blur(frames, np.zeros(frames.shape[1:], np.bool_), 65535.0, still=True)
    assert blur is not None
    assert blur.value == pytest.approx(psf_px, rel=0.03)
    assert still == 0
    assert point_blur(frames, np.zeros(frames.shape[1:], np.bool_), 1.0, still=True)[0] is None  # clipped


def test_psf_of_a_still_point() -> None:
    frames = noise_frames(1, (20, 64, 80), tvh=2.0)
    down, across = (np.diff(ndtr((np.arange(n + 1) - 0.5 - at) / 0.7)) for n, at in ((64, 30.2), (80, 40.4)))
    blur, still = point_blur(frames + 3000 * np.outer(down, across), np.zeros((64, 80), np.bool_), 65535.0, still=True)
    assert still == 1
    assert blur is not None
    assert blur.low <= 0.7 <= blur.high


def test_targets_and_small_objects_are_no_background() -> None:
    scene = picture(4)
    hot = scene.copy()
    hot[50:54, 80:86] += 400
    found = background(hot)
    assert found.objects == 1
    assert found.filled[52, 83]
    assert np.abs(found.picture - scene).max() < 60
    taken = np.zeros(SHAPE, np.bool_)
    taken[45:60, 75:90] = True
    assert background(hot, taken).objects == 0
    assert not background(scene).filled.any()


def test_passing_objects_leave_no_trace_in_the_mean() -> None:
    frames = noise_frames(1, (40, 64, 80), tvh=2.0)
    boxes = []
    for k in range(40):
        frames[k, 20:24, k : k + 4] += 500
        boxes.append((Region(max(k - 2, 0), 18, 8, 8),))
    mean, always = mean_picture(frames, 2.0, tuple(boxes))
    assert not always.any()
    assert mean.std() == pytest.approx(2 / math.sqrt(40), rel=0.1)
    clipped, _ = mean_picture(frames, 2.0, ((),) * 40)
    assert np.abs(clipped - mean).max() < 3
