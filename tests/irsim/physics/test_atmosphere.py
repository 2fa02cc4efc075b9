"""The air: the fitted table, limits, Kirchhoff's law, layers, the clear sky."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate

from irsim.physics.atmosphere import Atmosphere
from irsim.physics.climate import CLIMATES, FIT_VISIBILITY_KM, ClimateName, band_mismatch, fitted_band
from irsim.physics.radiometry import radiance, temperature
from irsim.types import Band, BandName

BANDS: list[BandName] = ["mwir", "lwir"]


@pytest.mark.parametrize("climate", CLIMATES)
@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("visibility", FIT_VISIBILITY_KM)
def test_level_paths_follow_the_fit(climate: ClimateName, band: BandName, visibility: float) -> None:
    a, b = CLIMATES[climate].fit[band][FIT_VISIBILITY_KM.index(visibility)]
    air = Atmosphere(preset=climate, visibility_km=visibility)
    km = np.array([0.5, 3.0, 20.0])  # the Earth's curve lifts 20 km by 31 m: under 0.002
    np.testing.assert_allclose(air.transmittance(band, km * 1e3), np.exp(-a * km**b), atol=0.002)


@pytest.mark.parametrize(("climate", "band"), list(zip(CLIMATES, 2 * BANDS, strict=True)))
@pytest.mark.parametrize("elevation", [0.0, np.pi / 2])
def test_transmittance_falls_with_range_and_haze(climate: ClimateName, band: BandName, elevation: float) -> None:
    ranges = np.geomspace(0.1, 200e3, 20)
    taus = [
        Atmosphere(preset=climate, visibility_km=visibility).transmittance(band, ranges, elevation)
        for visibility in (300, 23, 5, 1)
    ]
    assert all((np.diff(tau) <= 0).all() for tau in taus)
    assert all((thin >= thick).all() for thin, thick in pairwise(taus))


def test_a_path_of_zero_length_has_no_effect() -> None:
    air = Atmosphere(preset="tropical", visibility_km=5, rain_mm_h=20, fog_visibility_km=0.3)
    for band in BANDS:
        tau, light = air.path(band, 0.0)
        assert tau == 1
        assert light == 0
        tau, light = air.path(band, 1e-6)
        assert tau == pytest.approx(1, abs=1e-3)
        assert light < 1e-3 * radiance(band, 299.7)


def test_without_an_atmosphere_nothing_changes() -> None:
    air = Atmosphere()
    emission = np.array([1.0, 2.0])
    assert air.through("mwir", emission, np.ones(2), 5000.0, 0.1) is emission
    tau, light = air.path("mwir", 50e3)
    assert tau == 1
    assert light == 0
    assert air.surroundings("mwir") is None
    assert air.is_clear


@pytest.mark.parametrize(("band", "range_m"), [("mwir", 200.0), ((3.4, 4.9), 5000.0)])
def test_level_paths_obey_kirchhoff_s_law(band: Band, range_m: float) -> None:
    """Kirchhoff: at one temperature T the light of the path is (1 - tau) B(T)."""
    air = Atmosphere(preset="us_standard")
    tau, light = air.path(band, range_m)
    assert light == pytest.approx((1 - tau) * radiance(band, 288.15 - 0.65), rel=2e-4)  # 100 m up


@pytest.mark.parametrize("band", BANDS)
def test_a_black_body_at_air_temperature_vanishes(band: Band) -> None:
    """Before an opaque path a target at the temperature of the air has no contrast; a hot one has."""
    air = Atmosphere(preset="us_standard", fog_visibility_km=0.05)
    kelvin = 288.15 - 6.5 * 0.1
    near, far = 30.0, 30e3
    assert air.transmittance(band, far) < 1e-9
    behind = air.path(band, far)[1]
    own = air.through(band, radiance(band, kelvin), np.ones(()), near, 0.0)
    assert temperature(band, own) == pytest.approx(float(temperature(band, behind)), abs=0.01)
    hot = air.through(band, radiance(band, 400.0), np.ones(()), near, 0.0)
    assert temperature(band, hot) > temperature(band, behind) + 0.01


def test_slant_paths_integrate_density() -> None:
    """A slant path through thinning gas and haze, against quadrature along the ray: of the gas 4.8 % is as the air."""
    air = Atmosphere(preset="midlatitude_summer", altitude_m=500, visibility_km=23)
    elevation, km = 0.3, 12.0

    def height(s: float) -> float:
        base = 6371.0 + 0.5
        return float(np.sqrt(base**2 + s**2 + 2 * base * s * np.sin(elevation)) - 6371.0)

    def along(scale_km: float) -> float:
        return float(integrate.quad(lambda s: np.exp((0.1 - height(s)) / scale_km), 0, km)[0])

    gas, haze = 0.952 * along(1.8) + 0.048 * along(7.0), along(1.2)

    def added(km: float) -> float:
        return float((0.776 * km**0.56 - 0.711 * km**0.48) / (1 / 5 - 1 / 23))

    depth = 0.711 * gas**0.48 - added(gas) / 23 + added(haze) / 23
    assert air.transmittance("mwir", km * 1e3, elevation) == pytest.approx(np.exp(-depth), abs=1e-3)


CLEAR_SKY: dict[tuple[ClimateName, BandName, float], tuple[float, ...]] = {
    ("us_standard", "lwir", 0.0): (214, 230, 255, 269),
    ("us_standard", "mwir", 0.0): (269, 273, 279, 282),
    ("midlatitude_summer", "lwir", 0.0): (240, 258, 282, 289),
    ("us_standard", "lwir", 5e3): (167.7, 176.0, 188.6, 196.5),
    ("us_standard", "lwir", 10e3): (156.3, 163.2, 172.2, 176.7),
    ("us_standard", "mwir", 5e3): (228.5, 231.8, 237.0, 240.4),
    ("us_standard", "mwir", 15e3): (191.7, 194.3, 198.6, 201.2),
    ("midlatitude_summer", "lwir", 10e3): (158.1, 165.4, 175.2, 180.3),
    ("midlatitude_winter", "mwir", 10e3): (196.9, 199.5, 203.7, 206.2),
    ("tropical", "lwir", 10e3): (153.2, 160.4, 170.2, 175.3),
}
"""LOWTRAN7 (revision 4.2): brightness temperature, K, at elevations of 90, 30, 10 and 5 degrees from heights, m."""


@pytest.mark.parametrize(("climate", "band", "height_m"), CLEAR_SKY)
def test_the_clear_sky_matches_lowtran(climate: ClimateName, band: BandName, height_m: float) -> None:
    air = Atmosphere(preset=climate, altitude_m=height_m)
    found = temperature(band, air.sky(band, np.radians([90, 30, 10, 5])))
    np.testing.assert_allclose(found, CLEAR_SKY[climate, band, height_m], atol=3.5 if height_m else 2.0)


@pytest.mark.parametrize(("climate", "band"), list(zip(CLIMATES, 2 * BANDS, strict=True)))
def test_the_sky_is_the_path_to_space(climate: ClimateName, band: BandName) -> None:
    air = Atmosphere(preset=climate)
    elevations = np.radians([90, 20, 2])
    ends = np.array([39_900, 39_900 / np.sin(np.radians(20)) * 0.995, 380e3])
    np.testing.assert_allclose(air.sky(band, elevations), air.path(band, ends, elevations)[1], rtol=0.01)
    falling = temperature(band, air.sky(band, np.radians(np.arange(0, 91))))
    assert (np.diff(falling) < 0).all()
    assert air.sky(band, -0.3) == air.sky(band, 0.0)


def test_surroundings_are_half_sky_half_ground() -> None:
    air = Atmosphere(preset="us_standard", altitude_m=0)
    # The mean over all directions: the integral of L cos over elevation, by another rule.
    sky, _ = integrate.quad(lambda e: float(air.sky("lwir", e)) * np.cos(e), 0, np.pi / 2, epsrel=1e-6)
    expected = (sky + radiance("lwir", 288.15)) / 2
    assert air.surroundings("lwir") == pytest.approx(float(expected), rel=2e-4)
    given = Atmosphere(surroundings_k=250.0)
    assert given.surroundings("mwir") == pytest.approx(float(radiance("mwir", 250.0)))


def test_a_warmer_day_shifts_all_heights() -> None:
    day, base = Atmosphere(preset="us_standard", temperature_k=300.0), Atmosphere(preset="us_standard")
    for km in (0, 2, 11, 15):
        assert day.air_k(km) - base.air_k(km) == pytest.approx(11.85)
    assert base.air_k(11) == pytest.approx(216.65)


@pytest.mark.parametrize(("band", "fitted"), [((3.4, 4.9), "mwir"), ((8.0, 14.0), "lwir"), ((2.5, 4.5), "mwir")])
def test_band_mismatch_bounds_the_error(band: Band, fitted: BandName) -> None:
    """The worst air lets through just where the one band has more of its light than the other, by Planck's law."""
    um = np.linspace(2, 16, 140_001)
    planck = um**-5 / np.expm1(14387.77 / (um * 288.15))

    def weights(limits: tuple[float, float]) -> np.ndarray:
        inside = planck * ((um >= limits[0]) & (um <= limits[1]))
        return np.asarray(inside / inside.sum())

    assert isinstance(band, tuple)
    own, theirs = weights(band), weights({"mwir": (3.0, 5.0), "lwir": (8.0, 12.0)}[fitted])
    worst = (own * (own > theirs)).sum() - (theirs * (own > theirs)).sum()
    assert fitted_band(band) == fitted
    assert band_mismatch(band, fitted) == pytest.approx(worst, abs=1e-3)
    assert band_mismatch(fitted, fitted) == 0
