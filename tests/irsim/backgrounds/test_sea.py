"""Sea: reflectance and slopes against published figures, travelling waves, glint and visible facets."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from country import view_at
from pydantic import ValidationError

from irsim.backgrounds import Sea
from irsim.backgrounds.sea import reflectance, slope_variance, visible_facets
from irsim.backgrounds.waves import (
    GRAVITY,
    TRAIN_RAD,
    WaveOctave,
    directional_rms_rad,
    longest_wave,
    slope_components,
    wave_train,
)
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.radiometry import radiance, temperature
from irsim.types import BandName, Floats


def context(elevation_deg: float = 0.0, size: tuple[int, int] = (161, 121), seed: int = 1) -> SceneContext:
    return SceneContext(seed, Geometry(size, 0.5e-3, math.radians(elevation_deg)), 30.0, "lwir", 0.0)


def test_reflectance_of_water() -> None:
    """At normal incidence ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2), at grazing incidence 1."""
    for band, n, k in (("mwir", 1.351, 0.0046), ("lwir", 1.218, 0.0508)):
        expected = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
        assert float(reflectance(band, np.array(np.pi / 2))) == pytest.approx(expected, rel=1e-6)  # type: ignore[arg-type]  # the name of a band, to mypy any str
        assert float(reflectance(band, np.array(0.0))) == pytest.approx(1)  # type: ignore[arg-type]  # the name of a band, to mypy any str
    angles = np.linspace(0.01, np.pi / 2, 50)
    assert np.all(np.diff(reflectance("mwir", angles)) < 0)


def test_printed_figures_of_the_sea() -> None:
    """Cox and Munk: 0.0542 at 10 m/s. Pierson and Moskowitz: at 10 m/s the peak has a period of 7.3 s, so 83 m."""
    assert slope_variance(10.0) == pytest.approx(0.0542, abs=1e-4)
    period = 2 * math.pi * 10 / (0.877 * GRAVITY)
    assert period == pytest.approx(7.3, abs=0.01)
    assert longest_wave(10.0) == pytest.approx(GRAVITY * period**2 / (2 * math.pi), rel=1e-12)


def directions(number: int) -> tuple[Floats, Floats]:
    """Return the angles from the wind and the power spectra of the two trains of an octave."""
    fx, fy = np.fft.fftfreq(512)[None, :], np.fft.fftfreq(512)[:, None]
    angle = np.arctan2(fx, np.abs(fy))
    power = [
        np.mean([np.abs(np.fft.fft2(wave_train(seed, number, k))) ** 2 for seed in range(2)], axis=0) for k in (0, 1)
    ]
    return np.stack([angle - TRAIN_RAD, angle + TRAIN_RAD]), np.stack(power)


@pytest.mark.parametrize(("number", "degrees"), [(0, 24.7), (2, 42.7)])
def test_waves_have_their_directions_and_slopes(number: int, degrees: float) -> None:
    assert math.degrees(directional_rms_rad(number)) == pytest.approx(degrees, abs=0.1)
    angle, power = directions(number)
    assert math.degrees(math.sqrt(np.average(angle**2, weights=power))) == pytest.approx(degrees, rel=0.08)
    across, along = slope_components(number)
    assert across**2 == pytest.approx(np.average(np.sin(angle) ** 2, weights=power), abs=0.02)
    assert across**2 + along**2 == pytest.approx(1)
    right, far = np.random.default_rng(1).uniform(0, 1e4, (2, 200, 200)).astype(np.float32)
    for wind_deg, turned in ((0.0, False), (90.0, True)):
        to_right, to_camera = WaveOctave(6.0, wind_deg, number, 1).at(right, far, 0.0)
        beside, ahead = (to_camera, to_right) if turned else (to_right, to_camera)
        assert float(beside.var()) == pytest.approx(2 * across**2, rel=0.15)
        assert float(ahead.var()) == pytest.approx(2 * along**2, rel=0.15)


def test_still_water_mirrors_the_sky() -> None:
    """Without wind, at grazing angle d: rho(d) of the sky at d above the horizon and 1 - rho(d) of the water."""
    scene = context()
    sea = Sea(wind_m_s=0, horizon_k=270, zenith_k=270, water_k=290)
    (water,) = sea.layers(scene)
    light = water.light(view_at(scene))[1]
    assert temperature("lwir", light[:59, 80]) == pytest.approx(270, abs=0.01)
    share = reflectance("lwir", np.arctan((np.arange(64, 121) - 60) * 0.5e-3))
    expected = share * radiance("lwir", 270) + (1 - share) * radiance("lwir", 290)
    assert light[64:, 80] == pytest.approx(expected, rel=2e-3)


def test_waves_travel_and_frames_stand_alone() -> None:
    scene = context(elevation_deg=-3.0)
    sea = Sea(wind_m_s=5.0)
    (water,) = sea.layers(scene)
    frames = [water.light(view_at(scene, t))[1] for t in (0.0, 1 / 30, 2.0, 60.0)]
    (other,) = sea.layers(scene)
    assert np.array_equal(other.light(view_at(scene, 2.0))[1], frames[2])
    parts = [frame[60:].ravel() - frame[60:].mean() for frame in frames]

    def alike(a: int, b: int) -> float:
        return float(np.corrcoef(parts[a], parts[b])[0, 1])

    assert alike(0, 1) > 0.9
    assert alike(0, 2) < alike(0, 1)
    assert abs(alike(0, 3)) < 0.5
    assert frames[3].std() == pytest.approx(frames[0].std(), rel=0.5)


@pytest.mark.filterwarnings("error")
def test_a_calm_sea_is_the_limit_of_small_winds() -> None:
    """The mean of the water approaches that of a mirror, and nothing overflows."""
    scene = context(elevation_deg=-3.0)

    def kelvin(wind: float) -> Floats:
        light = Sea(wind_m_s=wind, sun_deg=(0.0, 3.0)).layers(scene)[0].light(view_at(scene, 1.0))[1]
        return np.asarray(temperature("lwir", light[40:]))

    calm = kelvin(0.0)
    off = [abs(kelvin(wind) - calm).mean() for wind in (0.3, 0.03, 1e-6)]
    assert off == sorted(off, reverse=True)
    assert off[-1] < 0.01
    assert np.array_equal(kelvin(1e-300), calm)
    assert [slope_variance(wind) for wind in (0.0, 0.25, 1.0, 2.0)] == pytest.approx([0, 0.00203, 0.00812, 0.01324])


WATER = {"mwir": 1.351 + 0.0046j, "lwir": 1.218 + 0.0508j}
"""Hale and Querry 1973, table I, at 4 and 10 um."""


def direction(azimuth: float, elevation: float) -> Floats:
    """Unit vector to the right, ahead and up, of angles in rad."""
    level = math.cos(elevation)
    return np.array([level * math.sin(azimuth), level * math.cos(azimuth), math.sin(elevation)])


def fresnel(band: str, incidence: float) -> float:
    """Reflectance for unpolarised light at an angle to the normal, by Snell's law and the two amplitudes."""
    index = WATER[band]
    cosine, inside = math.cos(incidence), np.sqrt(1 - (math.sin(incidence) / index) ** 2)
    across = (cosine - index * inside) / (cosine + index * inside)
    along = (index * cosine - inside) / (index * cosine + inside)
    return float(abs(across) ** 2 + abs(along) ** 2) / 2


@pytest.mark.parametrize(("band", "sun", "down", "azimuth"), [("lwir", 40.0, 1.0, 0.0), ("mwir", 10.0, 0.5, 2.0)])
def test_glint_is_that_of_the_mirroring_facet(band: BandName, sun: float, down: float, azimuth: float) -> None:
    """rho E p / (4 (sin d + sigma / 2) cos^4 tilt) (Cox and Munk 1954) of a sea too far for drawn waves.

    The facet's normal halves the angle between sun and camera; rho is Fresnel's at half that angle.
    """
    wind, depression = 8.0, math.radians(down)
    scene = SceneContext(1, Geometry((17, 17), 0.5e-3, -depression), 30.0, band, 0.0)
    far = {"wind_m_s": wind, "gusts": 0.0, "camera_height_m": 10_000.0}
    dark, lit = (
        Sea.model_validate({**far, **more}).layers(scene)[0].light(view_at(scene))[1][8, 8]
        for more in ({}, {"sun_deg": (azimuth, sun)})
    )

    to_sun = direction(math.radians(azimuth), math.radians(sun))
    to_camera = -direction(0.0, -depression)
    normal = (to_sun + to_camera) / np.linalg.norm(to_sun + to_camera)
    incidence = math.acos(normal @ to_sun)
    assert 2 * incidence == pytest.approx(math.acos(to_sun @ to_camera))
    one_axis = (0.003 + 0.00512 * wind) / 2
    slopes = -normal[:2] / normal[2]
    density = math.exp(-(slopes @ slopes) / (2 * one_axis)) / (2 * math.pi * one_axis)
    sunlight = 6.8e-5 * float(radiance(band, 5772.0))
    hidden = math.sin(depression) + 0.5 * math.sqrt(one_axis)
    expected = fresnel(band, incidence) * sunlight * density / (4 * hidden * normal[2] ** 4)
    assert lit - dark == pytest.approx(expected, rel=2e-3)


def test_the_air_attenuates_the_glint_on_both_paths() -> None:
    """From space to sea level, and from the sea to the camera."""
    clear = SceneContext(1, Geometry((17, 17), 0.5e-3, math.radians(-20)), 30.0, "mwir", 0.0)
    air = Atmosphere(preset="us_standard", altitude_m=300.0)
    sea = {"wind_m_s": 8.0, "gusts": 0.0, "camera_height_m": 300.0}

    def glint(scene: SceneContext) -> float:
        dark, lit = (
            Sea.model_validate({**sea, **more}).layers(scene)[0].light(view_at(scene))[1][8, 8]
            for more in ({}, {"sun_deg": (0.0, 30.0)})
        )
        return float(lit - dark)

    at_sea_level = air.model_copy(update={"altitude_m": 0.0})
    down = float(at_sea_level.transmittance_to_space("mwir", math.radians(30)))
    back = float(air.transmittance("mwir", 300 / math.sin(math.radians(20)), math.radians(-20)))
    assert glint(replace(clear, air=air)) / glint(clear) == pytest.approx(down * back, rel=5e-3)


def test_a_sun_that_has_set_is_refused() -> None:
    for elevation in (-5.0, -0.1, 91.0):
        with pytest.raises(ValidationError, match="sun_deg"):
            Sea(sun_deg=(0.0, elevation))
    assert Sea(sun_deg=(-400.0, 0.0)).sun_deg == (-400.0, 0.0)


FAR_M = 10_000.0
"""Height, m, at which a pixel is far wider than the longest wave, so that no wave is drawn."""


@pytest.mark.parametrize("wind_deg", [0.0, 200.0])
def test_waves_have_the_phase_speed_of_deep_water(wind_deg: float) -> None:
    """At 10 m/s the longest waves of 83 m have a period of 7.3 s (Pierson and Moskowitz).

    A train at an angle a to the wind runs at c cos(a) along the wind, its crests pass at c / cos(a): within 7 %.
    """
    right, ahead = np.meshgrid(np.arange(0, 4000, 11, dtype=np.float32), np.arange(0, 4000, 11, dtype=np.float32))
    octave, angle = WaveOctave(10.0, wind_deg, 0, 1), math.radians(wind_deg)
    later = np.stack(octave.at(right, ahead, 1.0)).ravel()
    moves = np.arange(-20.0, 20.5, 0.5)
    alike = [
        later @ np.stack(octave.at(right - move * math.sin(angle), ahead - move * math.cos(angle), 0.0)).ravel()
        for move in moves.astype(np.float32)
    ]
    assert moves[np.argmax(alike)] == pytest.approx(83.4 / 7.3, rel=0.1)


def test_gusts_run_with_the_wind() -> None:
    """A camera that moves with the wind sees the same gusts, one at rest sees others."""
    scene = SceneContext(1, Geometry((81, 61), 5e-3, math.radians(-40.0)), 30.0, "lwir", 0.0)
    gusty, even = (
        Sea(wind_m_s=6.0, wind_deg=60.0, gusts=share, camera_height_m=FAR_M).layers(scene)[0] for share in (0.3, 0.0)
    )
    place = (1200 * math.sin(math.radians(60)), 0.0, 1200 * math.cos(math.radians(60)))
    rest = view_at(scene, 200.0)
    before, moved, still = (
        (gusty.light(view)[1] - even.light(view)[1]).ravel()
        for view in (view_at(scene), replace(rest, place=place), rest)
    )
    assert np.corrcoef(before, moved)[0, 1] > 0.98
    assert np.corrcoef(before, still)[0, 1] < 0.5


SKY_K, WATER_K, WIND = 250.0, 290.0, 8.0


def visible_radiance(down_rad: float) -> Floats:
    """Return mean and sigma of the radiance of the visible facets `down_rad` below the horizon.

    Grazing angles are Gaussian, each weighted by its projected area.
    """
    grazing = down_rad + math.sqrt(slope_variance(WIND) / 2) * np.linspace(-6, 6, 4001)
    weights = np.maximum(grazing, 0) * np.exp(-(np.linspace(-6, 6, 4001) ** 2) / 2)
    share = reflectance("lwir", np.maximum(grazing, 0))
    light = share * float(radiance("lwir", SKY_K)) + (1 - share) * float(radiance("lwir", WATER_K))
    mean = np.average(light, weights=weights)
    return np.array([mean, math.sqrt(np.average((light - mean) ** 2, weights=weights))])


def water(down_deg: float, height_m: float, rows: int) -> Floats:
    context = SceneContext(1, Geometry((321, rows), 0.5e-3, -math.radians(down_deg)), 30.0, "lwir", 0.0)
    sea = Sea(wind_m_s=WIND, gusts=0.0, camera_height_m=height_m, horizon_k=SKY_K, zenith_k=SKY_K, water_k=WATER_K)
    (layer,) = sea.layers(context)
    return np.stack([layer.light(view_at(context, time))[1] for time in (0.0, 40.0, 80.0, 120.0)])


@pytest.mark.parametrize("down_deg", [2.0, 10.0, 30.0])
def test_mean_radiance_does_not_depend_on_drawn_waves(down_deg: float) -> None:
    """From 10 km no octave is drawn, from 10 m six of twelve: half of the variance of slopes."""
    exact, spread = visible_radiance(math.radians(down_deg))
    far, near = water(down_deg, FAR_M, 3), water(down_deg, 10.0, 3)
    assert far.mean() == pytest.approx(exact, rel=0.01)
    assert near.mean() == pytest.approx(exact, rel=0.02)
    assert far.std() < 0.25 * spread
    assert 0.2 * spread < near.std() < 0.9 * spread


def test_visible_facets_are_weighted_by_projected_area() -> None:
    """Against sums over Gaussians; sqrt(pi / 2) sigma at mean 0."""
    spread = 0.1
    for mean in (-0.1, 0.0, 0.05, 1.0):
        grazing = np.maximum(mean + spread * np.linspace(-6, 6, 4001), 0)
        weights = grazing * np.exp(-(np.linspace(-6, 6, 4001) ** 2) / 2)
        middle = np.average(grazing, weights=weights)
        variance = np.average((grazing - middle) ** 2, weights=weights)
        seen, left = visible_facets(np.array([mean]), np.array([spread**2]))
        assert seen[0] == pytest.approx(middle, rel=0.12)
        if mean >= 0:
            assert left[0] == pytest.approx(variance / spread**2, abs=0.06)
    assert visible_facets(np.zeros(1), np.array([spread**2]))[0][0] == pytest.approx(spread * math.sqrt(math.pi / 2))
    assert [float(each[0]) for each in visible_facets(np.array([0.2]), np.zeros(1))] == [0.2, 1.0]  # a mirror
