"""Pictures so large that a part of them is looked at: what is told of them is what was put in."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.ndimage import gaussian_filter

from irsim.measure import defects, field, measure_figures, measure_noise
from irsim.measure.field import fit_field, periodogram
from irsim.measure.over_time import median_of
from irsim.measure.picked import LARGE, coarseness
from irsim.measure.steady import slides

SHAPE = (1100, 1500)
SIGMA = 5.0
SPREAD = 40.0
BETA = 3.0
CORRELATION_PX = 60.0
PSF_PX = 0.6
FRAMES = 6
DEAD = [(40, 60), (550, 750), (1090, 1490)]
HOT = [(300, 20), (700, 1200)]


def texture(seed: int, shape: tuple[int, int] = SHAPE, psf_px: float = 0.0) -> npt.NDArray[np.float64]:
    """A Gaussian field of spectrum 1 / (1 + (c fx)^b + (c fy)^b) and standard deviation SPREAD, under a blur."""
    x, y = np.fft.rfftfreq(shape[1])[None], np.abs(np.fft.fftfreq(shape[0]))[:, None]
    power = 1 / (1 + (CORRELATION_PX * x) ** BETA + (CORRELATION_PX * y) ** BETA)
    white = np.random.default_rng(seed).normal(size=shape)
    field = np.fft.irfft2(np.fft.rfft2(white) * np.sqrt(power), shape)
    return np.asarray(gaussian_filter(SPREAD * field / field.std(), psf_px, mode="wrap"))


@functools.cache
def filmed() -> npt.NDArray[np.uint16]:
    """Noise of SIGMA before a texture that stands, and some bad pixels."""
    rng = np.random.default_rng(1)
    frames = 20000 + texture(0, psf_px=PSF_PX) + SIGMA * rng.normal(size=(FRAMES, *SHAPE))
    for row, column in DEAD:
        frames[:, row, column] = 0
    for row, column in HOT:
        frames[:, row, column] += 600
    return np.rint(frames).astype(np.uint16)


def test_a_large_picture_is_one_of_more_than_1280_x_1024_px() -> None:
    assert [coarseness(shape) for shape in ((1024, 1280), (1025, 1280), (3000, 4000))] == [1, 2, 4]
    assert np.prod(SHAPE) > LARGE


def test_noise_and_bad_pixels_of_a_large_picture() -> None:
    found = measure_noise(filmed(), 30.0)
    assert found.terms.tvh.value == pytest.approx(SIGMA, rel=0.02)
    assert (found.dead, found.hot, found.blinking) == (len(DEAD), len(HOT), 0)
    assert not found.slides
    bad = defects(filmed())
    assert np.argwhere(bad.dead).tolist() == sorted(map(list, DEAD))
    assert np.argwhere(bad.hot).tolist() == sorted(map(list, HOT))


def test_texture_of_a_large_picture() -> None:
    """Under a blur that is not seen, and found to be the likeliest."""
    found = measure_figures(filmed(), 30.0, passing=False)
    assert found.texture is not None
    assert found.psf.value == PSF_PX
    assert found.texture.spread.low < SPREAD < found.texture.spread.high
    assert found.texture.correlation_px.low < CORRELATION_PX < found.texture.correlation_px.high
    assert found.noise.value == pytest.approx(SIGMA, rel=0.02)


def test_a_spectrum_is_read_off_means_of_neighbouring_frequencies(monkeypatch: pytest.MonkeyPatch) -> None:
    """As well as off all of them."""
    noisy = texture(3) + SIGMA * np.random.default_rng(4).normal(size=SHAPE)
    power = periodogram(noisy)
    found = fit_field(power, SHAPE, 0.0)
    monkeypatch.setattr(field, "coarseness", lambda shape: 1)
    by_all = fit_field(power, SHAPE, 0.0)
    assert found.texture is not None
    assert by_all.texture is not None
    assert found.floor.low < SIGMA**2 < found.floor.high
    for name, true in (("beta_x", BETA), ("beta_y", BETA), ("correlation_px", CORRELATION_PX), ("stretch", 1.0)):
        one, all_ = getattr(found.texture, name), getattr(by_all.texture, name)
        assert one.low < true < one.high
        assert one.value == pytest.approx(all_.value, rel=0.002)
        assert one.high - one.low == pytest.approx(all_.high - all_.low, rel=0.02)
    np.testing.assert_allclose(found.density, by_all.density, rtol=0.03)


def test_a_large_scene_slides() -> None:
    rng = np.random.default_rng(5)
    wide = texture(6, (SHAPE[0], SHAPE[1] + 8))
    moved = np.stack([wide[:, 2 * k : SHAPE[1] + 2 * k] + SIGMA * rng.normal(size=SHAPE) for k in range(4)])
    assert slides(moved)
    moved[:, :, SHAPE[1] // 3 :] = SIGMA * rng.normal(size=(4, SHAPE[0], SHAPE[1] - SHAPE[1] // 3))
    assert not slides(moved)  # in a third of the picture alone


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_medians_over_time_are_those_of_numpy(count: int, kind: type[Any]) -> None:
    frames = np.random.default_rng(count).normal(100, 30, (count, 70, 300)).astype(kind)
    before = frames.copy()
    found = median_of(frames)
    expected = np.median(frames, axis=0)
    assert found.dtype == expected.dtype
    assert (found == expected).all()
    assert (median_of(list(frames)) == expected).all()
    assert (frames == before).all()
