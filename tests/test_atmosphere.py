"""The air: the fitted table, limits, Kirchhoff's law, layers, the clear sky, rain and fog, warnings."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import integrate

from irsim.atmosphere import Atmosphere, rain_extinction
from irsim.backgrounds.air import ground_range_m
from irsim.cli import check
from irsim.climate import CLIMATES, FOG, ClimateName, fitted_band
from irsim.doubts import doubts
from irsim.loader import warnings
from irsim.radiometry import Band, BandName, radiance, temperature
from irsim.render import Renderer
from irsim.scenario import Scenario

FITTED: dict[tuple[ClimateName, BandName, float], tuple[float, float]] = {
    ("us_standard", "mwir", 23): (0.554, 0.47),
    ("us_standard", "mwir", 5): (0.614, 0.57),
    ("us_standard", "lwir", 23): (0.130, 0.79),
    ("us_standard", "lwir", 5): (0.186, 0.86),
    ("midlatitude_summer", "mwir", 23): (0.711, 0.48),
    ("midlatitude_summer", "mwir", 5): (0.776, 0.56),
    ("midlatitude_summer", "lwir", 23): (0.295, 0.86),
    ("midlatitude_summer", "lwir", 5): (0.351, 0.89),
    ("midlatitude_winter", "mwir", 23): (0.491, 0.47),
    ("midlatitude_winter", "mwir", 5): (0.557, 0.58),
    ("midlatitude_winter", "lwir", 23): (0.094, 0.78),
    ("midlatitude_winter", "lwir", 5): (0.149, 0.87),
    ("tropical", "mwir", 23): (0.795, 0.48),
    ("tropical", "mwir", 5): (0.860, 0.55),
    ("tropical", "lwir", 23): (0.429, 0.87),
    ("tropical", "lwir", 5): (0.485, 0.89),
}
"""LOWTRAN7, level paths 100 m up: a, b of tau = exp(-a R^b)."""

BANDS: list[BandName] = ["mwir", "lwir"]


@pytest.mark.parametrize(("climate", "band", "visibility"), FITTED)
@pytest.mark.parametrize("km", [0.5, 1.0, 3.0, 10.0, 20.0])
def test_level_paths_follow_the_fit(climate: ClimateName, band: BandName, visibility: float, km: float) -> None:
    a, b = FITTED[climate, band, visibility]
    air = Atmosphere(preset=climate, visibility_km=visibility)
    # The Earth's curve lifts 20 km by 31 m: under 0.002.
    assert air.transmittance(band, km * 1e3) == pytest.approx(np.exp(-a * km**b), abs=0.002)


@pytest.mark.parametrize("climate", CLIMATES)
@pytest.mark.parametrize("band", BANDS)
def test_haze_between_the_fitted_visibilities_goes_with_extinction(climate: ClimateName, band: BandName) -> None:
    """At 1/V halfway between 1/5 and 1/23, 8.214 km, the depth lies halfway."""
    halfway = 2 / (1 / 5 + 1 / 23)
    depths = [
        -np.log(Atmosphere(preset=climate, visibility_km=km).transmittance(band, 6000.0)) for km in (5, 23, halfway)
    ]
    assert depths[2] == pytest.approx((depths[0] + depths[1]) / 2, rel=1e-9)


@pytest.mark.parametrize("climate", CLIMATES)
@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("elevation", [0.0, 0.3, np.pi / 2])
def test_longer_paths_and_thicker_haze_pass_less(climate: ClimateName, band: BandName, elevation: float) -> None:
    ranges = np.geomspace(0.1, 200e3, 60)
    taus = [
        Atmosphere(preset=climate, visibility_km=visibility).transmittance(band, ranges, elevation)
        for visibility in (300, 23, 10, 5, 1)
    ]
    assert all((np.diff(tau) <= 0).all() for tau in taus)
    assert all((thin >= thick).all() for thin, thick in pairwise(taus))


def test_at_the_camera_the_air_does_nothing() -> None:
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
    assert air.surroundings("mwir") == 0
    assert air.is_clear


@pytest.mark.parametrize("band", ["mwir", "lwir", (3.4, 4.9)])
@pytest.mark.parametrize("range_m", [200.0, 5000.0])
def test_a_level_path_shines_as_much_as_it_absorbs(band: Band, range_m: float) -> None:
    """Kirchhoff: at one temperature T the light of the path is (1 - tau) B(T)."""
    air = Atmosphere(preset="us_standard")
    tau, light = air.path(band, range_m)
    assert light == pytest.approx((1 - tau) * radiance(band, 288.15 - 0.65), rel=2e-4)  # 100 m up


@pytest.mark.parametrize("band", BANDS)
def test_a_black_body_at_air_temperature_vanishes_into_the_path(band: Band) -> None:
    """Of two targets before an opaque path that at the air's temperature cannot be told from it."""
    air = Atmosphere(preset="us_standard", fog_visibility_km=0.05)
    kelvin = 288.15 - 6.5 * 0.1
    near, far = 30.0, 30e3
    assert air.transmittance(band, far) < 1e-9
    behind = air.path(band, far)[1]
    own = air.through(band, radiance(band, kelvin), np.ones(()), near, 0.0)
    assert temperature(band, own) == pytest.approx(float(temperature(band, behind)), abs=0.01)
    hot = air.through(band, radiance(band, 400.0), np.ones(()), near, 0.0)
    assert temperature(band, hot) > temperature(band, behind) + 0.01


def test_a_half_covering_thing_takes_half_of_the_path_light() -> None:
    air = Atmosphere(preset="us_standard")
    tau, light = air.path("lwir", 4000.0, 0.2)
    arrived = air.through("lwir", np.array([3.0, 0.0]), np.array([0.5, 0.0]), 4000.0, 0.2)
    assert arrived[0] == pytest.approx(float(3 * tau + 0.5 * light))
    assert arrived[1] == 0


def test_a_vertical_path_holds_a_scale_height_of_gas() -> None:
    """From 100 m straight up to the top: H (1 - exp(-39.9 km / H)) of gas, H_a of haze, each as a level path."""
    air = Atmosphere(preset="us_standard", visibility_km=5)
    gas, haze = 2.1, 1.2
    added = (0.186 * haze**0.86 - 0.130 * haze**0.79) / (1 / 5 - 1 / 23) / 5
    clean = 0.130 * gas**0.79 - (0.186 * gas**0.86 - 0.130 * gas**0.79) / (1 / 5 - 1 / 23) / 23
    tau = air.transmittance("lwir", np.array(39_900.0), np.pi / 2)
    assert tau == pytest.approx(np.exp(-clean - added), abs=2e-3)


def test_slant_paths_integrate_density() -> None:
    """A slant path through thinning gas and haze, against quadrature along the ray."""
    air = Atmosphere(preset="midlatitude_summer", altitude_m=500, visibility_km=23)
    elevation, km = 0.3, 12.0

    def height(s: float) -> float:
        base = 6371.0 + 0.5
        return float(np.sqrt(base**2 + s**2 + 2 * base * s * np.sin(elevation)) - 6371.0)

    gas, _ = integrate.quad(lambda s: np.exp((0.1 - height(s)) / 1.5), 0, km)
    haze, _ = integrate.quad(lambda s: np.exp((0.1 - height(s)) / 1.2), 0, km)

    def added(km: float) -> float:
        return float((0.776 * km**0.56 - 0.711 * km**0.48) / (1 / 5 - 1 / 23))

    depth = 0.711 * gas**0.48 - added(gas) / 23 + added(haze) / 23
    assert air.transmittance("mwir", km * 1e3, elevation) == pytest.approx(np.exp(-depth), abs=1e-3)


def test_higher_up_the_air_is_clearer() -> None:
    taus = [Atmosphere(preset="tropical", altitude_m=height).transmittance("lwir", 10e3) for height in (0, 1e3, 8e3)]
    assert taus[0] < taus[1] < taus[2]
    assert taus[2] > 0.95


CLEAR_SKY: dict[tuple[ClimateName, BandName], tuple[float, ...]] = {
    ("us_standard", "lwir"): (214, 230, 255, 269, 284),
    ("us_standard", "mwir"): (269, 273, 279, 282, 285),
    ("midlatitude_summer", "lwir"): (240, 258, 282, 289, 292),
}
"""LOWTRAN7: brightness temperature, K, at elevations of 90, 30, 10, 5 and 1 degrees."""


@pytest.mark.parametrize(("climate", "band"), CLEAR_SKY)
def test_the_layered_sky_is_the_printed_one(climate: ClimateName, band: BandName) -> None:
    air = Atmosphere(preset=climate, altitude_m=0)
    found = temperature(band, air.sky(band, np.radians([90, 30, 10, 5, 1])))
    np.testing.assert_allclose(found, CLEAR_SKY[climate, band], atol=2.0)


@pytest.mark.parametrize("climate", CLIMATES)
@pytest.mark.parametrize("band", BANDS)
def test_the_sky_is_the_path_to_the_end_of_the_air(climate: ClimateName, band: BandName) -> None:
    air = Atmosphere(preset=climate)
    elevations = np.radians([90, 20, 2])
    ends = np.array([39_900, 39_900 / np.sin(np.radians(20)) * 0.995, 380e3])
    np.testing.assert_allclose(air.sky(band, elevations), air.path(band, ends, elevations)[1], rtol=0.01)
    falling = temperature(band, air.sky(band, np.radians(np.arange(0, 91))))
    assert (np.diff(falling) < 0).all()
    assert air.sky(band, -0.3) == air.sky(band, 0.0)


def test_surroundings_are_half_sky_half_ground() -> None:
    air = Atmosphere(preset="us_standard", altitude_m=0)
    # Irradiance over pi: the integral of L 2 sin cos over elevation, by another rule.
    sky, _ = integrate.quad(lambda e: float(air.sky("lwir", e)) * np.sin(2 * e), 0, np.pi / 2, epsrel=1e-6)
    expected = (sky + radiance("lwir", 288.15)) / 2
    assert air.surroundings("lwir") == pytest.approx(float(expected), rel=2e-4)
    given = Atmosphere(surroundings_k=250.0)
    assert given.surroundings("mwir") == pytest.approx(float(radiance("mwir", 250.0)))


def test_a_warmer_day_shifts_all_heights() -> None:
    day, base = Atmosphere(preset="us_standard", temperature_k=300.0), Atmosphere(preset="us_standard")
    for km in (0, 2, 11, 15):
        assert day.air_k(km) - base.air_k(km) == pytest.approx(11.85)
    assert base.air_k(11) == pytest.approx(216.65)


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


def extinction(size: float, index: complex) -> float:
    """Mie's efficiency of extinction of a sphere of size parameter `size` (Bohren & Huffman, 1983, ch. 4)."""
    orders = int(size + 4 * size ** (1 / 3) + 2)
    y = index * size
    ratio = np.zeros(max(orders, int(abs(y))) + 16, complex)
    for n in range(len(ratio) - 1, 0, -1):
        ratio[n - 1] = n / y - 1 / (ratio[n] + n / y)
    psi, chi, total = [np.cos(size), np.sin(size)], [-np.sin(size), np.cos(size)], 0.0
    for n in range(1, orders + 1):
        psi = [psi[1], (2 * n - 1) * psi[1] / size - psi[0]]
        chi = [chi[1], (2 * n - 1) * chi[1] / size - chi[0]]
        now, before = psi[1] - 1j * chi[1], psi[0] - 1j * chi[0]
        for factor in (ratio[n] / index, ratio[n] * index):
            inner = factor + n / size
            total += (2 * n + 1) * ((inner * psi[1] - psi[0]) / (inner * now - before)).real
    return 2 / size**2 * total


WATER: dict[BandName, list[tuple[float, complex]]] = {
    "mwir": [(3.5, 1.400 + 0.0094j), (4.0, 1.351 + 0.0046j), (4.5, 1.332 + 0.0134j)],
    "lwir": [(8.0, 1.291 + 0.0343j), (9.0, 1.262 + 0.0399j), (10.0, 1.218 + 0.0508j), (11.0, 1.153 + 0.0968j),
             (12.0, 1.111 + 0.199j)],
}  # fmt: skip
"""Wavelength, um, and refractive index of water (Hale & Querry 1973)."""


@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize(("kind", "power", "rate"), [("advection", 3, 0.3), ("radiation", 6, 3.0)])
def test_fog_in_the_infrared_is_mie_scattering_by_its_drops(
    band: BandName, kind: str, power: float, rate: float
) -> None:
    radius = np.linspace(0.2, 50, 220)
    weight = radius ** (power + 2) * np.exp(-rate * radius)
    keep = weight > 1e-4 * weight.max()

    def mean(um: float, index: complex) -> float:
        each = [extinction(2 * np.pi * r / um, index) for r in radius[keep]]
        return float(np.average(each, weights=weight[keep]))

    visible = mean(0.55, 1.333)
    found = np.mean([mean(um, index) / visible for um, index in WATER[band]])
    assert FOG[kind][band] == pytest.approx(found, abs=0.02)


@pytest.mark.parametrize(
    ("band", "name"),
    [("mwir", "mwir"), ((3.4, 4.9), "mwir"), ((7.5, 14.0), "lwir"), ((5.2, 7.0), None), ((2.0, 14.0), None)],
)
def test_the_fit_of_the_nearest_band_serves(band: Band, name: BandName | None) -> None:
    assert fitted_band(band) == name


def scene(**other: Any) -> Scenario:
    value: dict[str, Any] = {
        "frames": 5,
        "camera": {"size": (64, 48), "netd_mk": 0.0},
        "atmosphere": {"preset": "us_standard"},
        "background": {"kind": "ground", "spread_k": 0.0},
        "targets": [target(2000.0)],
    }
    return Scenario.model_validate({**value, **other})


def target(range_m: float, **shape: Any) -> dict[str, Any]:
    path = {"kind": "straight", "start": (32.0, 24.0), "speed": 0.0, "range_m": range_m}
    return {"id": "jet", "shape": {"kind": "fighter", **shape}, "path": path}


def test_a_band_without_a_fit_is_refused_where_there_is_an_atmosphere() -> None:
    camera = {"band": (5.2, 7.0)}
    with pytest.raises(ValidationError, match=r"no atmosphere is fitted to a band of 5.2 to 7 um"):
        scene(camera=camera)
    assert scene(camera=camera, atmosphere={}).camera.band == (5.2, 7.0)


@pytest.mark.parametrize(
    ("change", "place", "words"),
    [
        ({"targets": [target(400.0)]}, ("targets", 0, "path"), "frame 0: a range of 0.4 km lies beyond"),
        ({"targets": [target(25e3)]}, ("targets", 0, "path"), "a range of 25 km lies beyond the fitted 0.5 to 20 km"),
        ({"atmosphere": {"preset": "tropical", "visibility_km": 2}}, ("atmosphere", "visibility_km"), "2 km lies"),
        ({"atmosphere": {"preset": "tropical", "altitude_m": 3000}}, ("targets", 0, "path"), "holds 14% of the gas"),
        ({"camera": {"band": (3.4, 4.9)}}, ("atmosphere", "preset"), "that of mwir is used"),
    ],
)
def test_beyond_the_fit_is_told_with_its_place(change: dict[str, Any], place: tuple[str, ...], words: str) -> None:
    (notice,) = doubts(scene(**change))
    assert notice.at == place
    assert words in notice.what


def test_within_the_fit_nothing_is_told() -> None:
    assert list(doubts(scene())) == []
    assert list(doubts(scene(atmosphere={}, targets=[target(50e3)]))) == []


def test_a_target_arrives_weakened_with_the_light_of_its_path() -> None:
    """A black fighter that fills pixels, 2 km off: tau B(300) + L_path there, whatever is behind."""
    camera = {"size": (64, 48), "netd_mk": 0.0, "ifov_mrad": 0.05, "psf_px": 0.0}
    wide = scene(camera=camera, targets=[target(2000.0, emissivity=1.0, engine_k=300.0)])
    light, truth = Renderer(wide).scene(0)
    tau, path = wide.air.path("mwir", truth.targets[0].range_m or 0.0)
    expected = tau * radiance("mwir", 300.0) + path
    near = np.abs(light - expected) < 1e-4 * expected
    assert near.sum() > 100
    grey = scene(camera=camera, targets=[target(2000.0, emissivity=0.6, engine_k=300.0)])
    found = Renderer(grey).scene(0)[0][near]
    mixed = 0.6 * radiance("mwir", 300.0) + 0.4 * grey.air.surroundings("mwir")
    np.testing.assert_allclose(found, tau * mixed + path, rtol=2e-4)


def test_the_signal_stays_where_truth_says() -> None:
    """The centroid of target less empty scene is the truth's, path light and all (against a dark sky)."""
    dark = {"kind": "sky", "horizon_k": 20.0, "zenith_k": 20.0}
    with_target, empty = scene(background=dark), scene(background=dark, targets=[])
    light, truth = Renderer(with_target).scene(2)
    signal = light.astype(np.float64) - Renderer(empty).scene(2)[0]
    y, x = np.indices(signal.shape)
    found = (signal * x).sum() / signal.sum(), (signal * y).sum() / signal.sum()
    assert found == pytest.approx(truth.targets[0].signal_center, abs=5e-3)


def test_the_presets_sky_stands_behind_all() -> None:
    sky = {"kind": "sky", "preset": "midlatitude_summer"}
    camera = {"size": (64, 48), "netd_mk": 0.0, "elevation_deg": 30.0, "band": "lwir"}
    scenario = scene(background=sky, camera=camera, atmosphere={"altitude_m": 0.0}, targets=[])
    light = Renderer(scenario).scene(0)[0]
    # The middle lies between the two pixels about it: 30 degrees, 258 K printed.
    middle = float(temperature("lwir", light[23:25, 31:33].mean()))
    air = Atmosphere(preset="midlatitude_summer", altitude_m=0)
    assert middle == pytest.approx(float(temperature("lwir", air.sky("lwir", np.pi / 6))), abs=0.01)
    assert middle == pytest.approx(258, abs=2)
    with pytest.raises(ValidationError, match="no atmosphere is fitted"):
        scene(background=sky, camera={"band": (5.2, 7.0)}, atmosphere={})


def test_a_sky_unlike_the_air_before_it_is_told() -> None:
    for sky, words in (({}, "of its own temperatures"), ({"preset": "tropical"}, "of tropical")):
        (notice,) = doubts(scene(background={"kind": "sky", **sky}))
        assert notice.at == ("background", "preset")
        assert words in notice.what
    assert list(doubts(scene(background={"kind": "sky", "preset": "us_standard"}))) == []


@pytest.mark.parametrize(("degrees", "height_m", "range_m"), [(90, 100, 100), (30, 100, 200), (45, 1000, 1414.4)])
def test_ground_lies_where_the_ray_falls(degrees: float, height_m: float, range_m: float) -> None:
    assert ground_range_m(height_m, np.radians(degrees)) == pytest.approx(range_m, rel=2e-4)


def test_the_horizon_is_as_far_as_pythagoras_says() -> None:
    """From 100 m: sqrt(2 * 6371 km * 0.1 km) = 35.70 km, also for rays above it."""
    dip = np.arccos(6371.0 / 6371.1)
    np.testing.assert_allclose(ground_range_m(100.0, np.array([dip, 0.0, -0.2])), 35.70e3, rtol=1e-3)


def test_a_camera_on_the_ground_sees_it() -> None:
    light = Renderer(scene(atmosphere={"preset": "us_standard", "altitude_m": 0.0}, targets=[])).scene(0)[0]
    assert np.isfinite(light).all()


def test_far_ground_fades_into_the_air_and_near_ground_stays() -> None:
    camera = {"size": (64, 400), "netd_mk": 0.0, "ifov_mrad": 1.0, "elevation_deg": -10.0, "band": "lwir"}
    air = {"preset": "tropical", "visibility_km": 5}
    warm = {"kind": "ground", "spread_k": 0.0, "mean_k": 310.0}
    scenario = scene(camera=camera, atmosphere=air, background=warm, targets=[])
    kelvin = temperature("lwir", Renderer(scenario).scene(0)[0])
    horizon = round(199.5 - np.tan(np.radians(10)) / 1e-3)  # the level, px
    assert kelvin[horizon, 32] == pytest.approx(299.7 - 0.6, abs=0.2)
    below = 300  # px: depression 10 degrees and atan(0.1005)
    depression = np.radians(10) + np.arctan((below - 199.5) * 1e-3)
    tau, path = Atmosphere.model_validate(air).path("lwir", 100 / np.sin(depression), -depression)
    assert kelvin[below, 32] == pytest.approx(
        float(temperature("lwir", tau * radiance("lwir", 310.0) + path)), abs=0.01
    )


def test_the_sea_meets_the_sky_at_the_horizon() -> None:
    """Far water is hidden by the air before it: at the horizon sea and sky have one temperature, near ones differ."""
    camera = {"size": (64, 200), "netd_mk": 0.0, "ifov_mrad": 1.0, "band": "lwir", "psf_px": 0.0}
    sea = {"kind": "sea", "preset": "tropical", "water_k": 285.0, "wind_m_s": 0.0, "camera_height_m": 100.0}
    bare = Renderer(scene(camera=camera, background=sea, atmosphere={}, targets=[])).scene(0)[0]
    hazy = Renderer(scene(camera=camera, background=sea, atmosphere={"preset": "tropical"}, targets=[])).scene(0)[0]
    middle = temperature("lwir", hazy[:, 32]) - temperature("lwir", bare[:, 32])
    assert abs(middle[:99]).max() < 1e-3  # the sky stands as it is
    water = temperature("lwir", hazy[100:, 32])
    assert water[1] == pytest.approx(float(temperature("lwir", hazy[97, 32])), abs=1.5)
    below = np.arctan(0.0805)  # row 180
    tau, path = Atmosphere(preset="tropical").path("lwir", 100 / np.sin(below), -below)
    assert hazy[180, 32] == pytest.approx(float(tau * bare[180, 32] + path), rel=1e-3)


def test_clouds_arrive_through_the_air_before_them() -> None:
    """Thick cloud all over, 6 km off: tau B(260) + L_path."""
    cloud = {"coverage": 0.999, "depth": 1000.0, "temperature_k": 260.0, "texture_k": 0.0, "range_m": 6000.0}
    sky = {"kind": "sky", "preset": "us_standard", "clouds": [cloud]}
    camera = {"size": (64, 48), "netd_mk": 0.0, "elevation_deg": 20.0, "band": "lwir"}
    light = Renderer(scene(background=sky, camera=camera, targets=[])).scene(0)[0]
    tau, path = Atmosphere(preset="us_standard").path("lwir", 6000.0, np.radians(20))
    assert np.median(light) == pytest.approx(float(tau * radiance("lwir", 260.0) + path), rel=1e-4)


def test_warnings_have_their_place_in_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = """\
frames: 3
camera: {size: [64, 48]}
atmosphere:
  preset: us_standard
  visibility_km: 40
background: {kind: ground}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [32, 24], range_m: 30000}}
"""
    file = tmp_path / "far.yaml"
    file.write_text(text)
    hazy, far = warnings(file)
    assert hazy == (
        f"{file}:5:18: atmosphere.visibility_km: warning: 40 km lies beyond the fitted 5 to 23 km; "
        "haze goes with the inverse of visibility"
    )
    assert far == (
        f"{file}:8:45: targets.jet.path: warning: frame 0: a range of 30 km lies beyond the fitted 0.5 to 20 km"
    )
    assert warnings(file, ["atmosphere.preset=none"]) == []
    check([str(file)])
    printed = capsys.readouterr()
    assert printed.out == f"{file}: ok\n"
    assert printed.err.splitlines() == [hazy, far]


def test_the_atmosphere_is_switched_off_by_name() -> None:
    off = scene(without=["atmosphere"])
    none = scene(atmosphere={})
    assert np.array_equal(Renderer(off).frame(1)[0].image, Renderer(none).frame(1)[0].image)
    assert not np.array_equal(Renderer(scene()).frame(1)[0].image, Renderer(none).frame(1)[0].image)
