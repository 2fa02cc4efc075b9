"""Rain and fog, against printed figures and Mie scattering."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irsim.physics.atmosphere import EARTH_KM, Atmosphere
from irsim.physics.climate import FOG, rain_extinction
from irsim.physics.radiometry import radiance, temperature
from irsim.types import BandName, Floats

BANDS: list[BandName] = ["mwir", "lwir"]
FOGGY: dict[str, Any] = {"fog_visibility_km": 0.2}


@pytest.mark.parametrize(("mm_h", "db_km"), [(1, 1.58), (10, 6.74), (50, 18.6)])
def test_rain_attenuates_as_printed(mm_h: float, db_km: float) -> None:
    """1.58 r^0.63 dB/km (ITU-R P.1814), in every band."""
    assert 10 / np.log(10) * rain_extinction(mm_h) == pytest.approx(db_km, rel=4e-3)
    air = Atmosphere(rain_mm_h=mm_h)
    for band in (*BANDS, (5.0, 7.0)):
        assert -10 * np.log10(air.transmittance(band, 500.0)) == pytest.approx(db_km / 2, rel=4e-3)


def test_rain_falls_from_three_kilometres() -> None:
    air = Atmosphere(rain_mm_h=5.0, altitude_m=0)
    assert -np.log(air.transmittance("lwir", 10e3, np.pi / 2)) == pytest.approx(3 * 0.365 * 5**0.63, rel=1e-6)
    above = Atmosphere(rain_mm_h=5.0, altitude_m=5000)
    assert above.transmittance("lwir", 10e3, 0.1) == 1
    assert -np.log(above.transmittance("lwir", 5e3, -np.pi / 2)) == pytest.approx(3 * 0.365 * 5**0.63, rel=1e-6)


def test_fog_hides_by_its_visibility() -> None:
    """3.912/V at 0.55 um, times the ratio of the band; level path within the fog."""
    for kind, ratios in FOG.items():
        for band, ratio in ratios.items():
            air = Atmosphere.model_validate({"fog_visibility_km": 0.4, "fog": kind})
            assert -np.log(air.transmittance(band, 150.0)) == pytest.approx(3.912 / 0.4 * 0.15 * ratio, rel=1e-9)


def test_fog_lies_up_to_two_hundred_metres() -> None:
    """Straight up from the sea the path holds 0.2 km of it, from half that height half as much, from above none."""
    for altitude_m, km in ((0.0, 0.2), (100.0, 0.1), (250.0, 0.0)):
        air = Atmosphere(fog_visibility_km=0.4, altitude_m=altitude_m)
        expected = 3.912 / 0.4 * km * FOG["radiation"]["lwir"]
        assert -np.log(air.transmittance("lwir", 10e3, np.pi / 2)) == pytest.approx(expected, rel=1e-6)


def seen_k(band: BandName, tau: Floats, light: Floats) -> Floats:
    """Return the apparent temperature of a black body of 290 K at the end of a path, K."""
    return temperature(band, tau * radiance(band, 290.0) + light)


@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("altitude_m", [0.0, 150.0, 2900.0, 12_000.0])
def test_path_steps_are_fine_enough(band: BandName, altitude_m: float) -> None:
    """Up, level and down to the ground or the horizon, within 0.05 K of a path of 2000 steps from each end."""
    weather: list[dict[str, Any]] = [
        *({"preset": "tropical"}, {"preset": "midlatitude_winter", **FOGGY}, {"rain_mm_h": 100.0}),
    ]
    height = altitude_m / 1e3
    elevation, along = [0.0, 0.0, 0.02, 0.2, np.pi / 2], [2.0, 60.0, 60.0, 30.0, 20.0]
    for down in (-np.pi / 2, -0.35, -0.05):
        base, sine = EARTH_KM + height, np.sin(down)
        square = EARTH_KM**2 - base**2 * (1 - sine**2)
        if height:
            elevation.append(down)
            along.append(-base * sine - np.sqrt(square) if square > 0 else np.sqrt(base**2 - EARTH_KM**2))
    places = np.array(along), np.array(elevation)
    for given in weather:
        air = Atmosphere(altitude_m=altitude_m, **given)
        found = seen_k(band, *air.path(band, places[0] * 1e3, places[1]))
        finely = seen_k(band, *air._path(band, *places, 2000))
        np.testing.assert_allclose(found, finely, atol=0.05, rtol=0, err_msg=str(given))


@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("altitude_m", [300.0, 12_000.0])
def test_fog_from_above_has_the_temperature_at_depth_one(band: BandName, altitude_m: float) -> None:
    """Its light is linear in its depth, nearly: that of all depths d, by exp(-d), is that of their mean, 1."""
    air = Atmosphere(fog_visibility_km=0.1, fog="advection", altitude_m=altitude_m)
    extinction_km = 3.912 / 0.1 * FOG["advection"][band]
    seen = temperature(band, air.path(band, altitude_m, -np.pi / 2)[1])
    assert float(seen) == pytest.approx(float(air.air_k(0.2 - 1 / extinction_km)), abs=0.02)
