"""In-band radiance against direct integration, printed figures and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import constants, integrate

from irsim.physics.radiometry import (
    TABLE_K,
    Scale,
    band_fault,
    hemisphere,
    limits,
    planck,
    radiance,
    slope,
    temperature,
)
from irsim.types import Band

BANDS: list[Band] = ["mwir", "lwir", (19.9, 20.0)]


def spectral(wavelength_m: float, kelvin: float) -> float:
    """Planck's law as printed, W/m2/sr/m."""
    h, c, k = constants.h, constants.c, constants.k
    return float(2 * h * c**2 / wavelength_m**5 / np.expm1(h * c / (wavelength_m * k * kelvin)))


def in_band(band: Band, kelvin: float) -> float:
    low, high = limits(band)
    unit = spectral(high * 1e-6, kelvin)  # quad's tolerances want numbers near 1
    found, _ = integrate.quad(lambda x: spectral(x * 1e-6, kelvin) / unit, low, high, epsabs=0, epsrel=1e-11)
    return float(found * unit * 1e-6)


@pytest.mark.parametrize(("band", "kelvin", "printed"), [("mwir", 300, 1.866), ("lwir", 300, 38.5), ("mwir", 600, 547)])
def test_printed_radiances(band: Band, kelvin: float, printed: float) -> None:
    assert radiance(band, kelvin) == pytest.approx(printed, rel=5e-4)


@pytest.mark.parametrize("band", BANDS)
def test_radiance_is_planck_integrated(band: Band) -> None:
    kelvin = np.array([20.0, 77.3, 180.1, 255.55, 300.0, 341.7, 600.0, 1234.5, 5777.0])
    np.testing.assert_allclose(radiance(band, kelvin), [in_band(band, k) for k in kelvin], rtol=3e-6)


@pytest.mark.parametrize(("band", "kelvin"), list(zip(BANDS, (220.0, 300.0, 900.0), strict=True)))
def test_slope_is_the_derivative(band: Band, kelvin: float) -> None:
    step = 0.05  # third derivatives make the difference quotient wrong by less than 1e-6
    difference = (in_band(band, kelvin + step) - in_band(band, kelvin - step)) / (2 * step)
    assert slope(band, kelvin) == pytest.approx(difference, rel=2e-6)


@pytest.mark.parametrize("band", BANDS)
def test_temperature_inverts_radiance(band: Band) -> None:
    kelvin = np.linspace(TABLE_K[0], TABLE_K[1], 2001).reshape(3, -1)
    np.testing.assert_allclose(temperature(band, radiance(band, kelvin)), kelvin, rtol=1e-12)
    assert temperature(band, 0.0) == temperature(band, -1.0) == TABLE_K[0]


def test_all_wavelengths_give_stefan_boltzmann() -> None:
    for kelvin in (250.0, 300.0, 1000.0):
        # In log wavelength, as the spectrum spans decades.
        total, _ = integrate.quad(
            lambda x, k=kelvin: float(planck(np.exp(x), k)) * np.exp(x), np.log(0.2), np.log(1e5), limit=200
        )
        assert total == pytest.approx(constants.sigma * kelvin**4 / np.pi, rel=1e-8)


@pytest.mark.parametrize("band", [(5.0, 3.0), (1.9, 4.0), (8.0, 20.1), (4.0, 4.04), (float("nan"), 4.0)])
def test_invalid_bands_are_reported(band: Band) -> None:
    assert band_fault(band) is not None
    assert band_fault("mwir") is None
    assert band_fault((3.4, 4.9)) is None


def test_hemispherical_mean_of_closed_forms() -> None:
    """By Archimedes' hat-box theorem the sine of elevation is spread evenly: the mean of sin^n is 1 / (n + 1)."""
    assert hemisphere(lambda elevation: 3.0 + 2.0 * np.sin(elevation)) == pytest.approx(4.0, rel=1e-12)
    assert hemisphere(lambda elevation: np.sin(elevation) ** 5) == pytest.approx(1 / 6, rel=1e-12)
    steep = hemisphere(lambda elevation: np.exp(-np.sin(elevation) / 0.01))
    assert steep == pytest.approx(0.01 * (1 - np.exp(-100)), rel=1e-9)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_scale_with_a_root_is_inverted(kind: type[Any]) -> None:
    scale = Scale(3784.27, 72.847, 120.0)
    light = np.linspace(0, 4, 1000).astype(kind)
    counts = (3784.27 * light + 72.847 * np.sqrt(light) + 120.0).astype(kind)
    np.testing.assert_allclose(scale.light(counts), light, atol=1e-6 if kind is np.float32 else 1e-13)
    np.testing.assert_allclose(scale.rise(light[:-1], light[1:]), np.diff(counts), atol=5e-3)
    assert scale.slope(1.0) == pytest.approx((counts[251] - counts[249]) / (light[251] - light[249]), rel=1e-3)
    assert scale.light(np.array([100.0], dtype=kind)).item() == 0  # darker than no light at all


@pytest.mark.parametrize("bits", [8, 16])
def test_every_count_comes_back_from_radiance(bits: int) -> None:
    scale = Scale.between("lwir", (220.0, 400.0), bits)
    counts = np.arange(2**bits).astype(np.float32)
    light = scale.light(counts)
    assert np.array_equal(np.rint(counts + scale.rise(light, light)), counts)
    np.testing.assert_allclose(scale.linear * scale.light(counts.astype(np.float64)) + scale.zero, counts, atol=1e-6)
