"""The sea and its wind: how fast and where to its waves and gusts run, and which facets are seen at grazing angles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irsim.backgrounds import Sea, ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.sea import SeaSurface, facing, reflectance, slope_variance
from irsim.backgrounds.waves import WaveOctave
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.physics.radiometry import radiance
from irsim.types import Floats

FAR_M = 10_000.0
"""From so high a pixel is far wider than the longest wave: none is drawn, all roughen the surface within a pixel."""


def seen_from(
    context: SceneContext, time: float = 0.0, place: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> ViewDirection:
    return ViewDirection(time, Chart.at(context.geometry, context.geometry.world_rotation(np.zeros(3))), place=place)


@pytest.mark.parametrize("wind_deg", [0.0, 90.0, 200.0])
def test_waves_run_with_the_wind_as_fast_as_on_deep_water(wind_deg: float) -> None:
    """At 10 m/s the longest take their 7.3 s for their 83 m (Pierson and Moskowitz): after a second the water is most
    like that before moved so far along the wind. Each train runs a little to its own side, c cos(side) along the wind,
    and crests square to its way pass along the wind at c / cos(side): within 7 %."""
    right, ahead = np.meshgrid(np.arange(0, 4000, 11, dtype=np.float32), np.arange(0, 4000, 11, dtype=np.float32))
    octave, angle = WaveOctave(10.0, wind_deg, 0, 1), math.radians(wind_deg)
    later = np.stack(octave.at(right, ahead, 1.0)).ravel()
    moves = np.arange(-20.0, 20.5, 0.5)
    alike = [
        later @ np.stack(octave.at(right - move * math.sin(angle), ahead - move * math.cos(angle), 0.0)).ravel()
        for move in moves.astype(np.float32)
    ]
    assert moves[np.argmax(alike)] == pytest.approx(83.4 / 7.3, rel=0.1)


@pytest.mark.parametrize("wind_deg", [60.0, -150.0])
def test_gusts_run_with_the_wind(wind_deg: float) -> None:
    """A camera that goes with the wind sees the same ones; one that stands sees others."""
    context, angle = (
        SceneContext(1, Geometry((81, 61), 5e-3, math.radians(-40.0)), 30.0, "lwir", 0.0),
        math.radians(wind_deg),
    )
    water, even = (
        Sea(wind_m_s=6.0, wind_deg=wind_deg, gusts=share, camera_height_m=FAR_M).layers(context)[0]
        for share in (0.3, 0.0)
    )
    way_m = 6.0 * 200.0
    gone = (way_m * math.sin(angle), 0.0, way_m * math.cos(angle))

    def gusts(view_direction: ViewDirection) -> Floats:
        return (
            water.light(view_direction)[1] - even.light(view_direction)[1]
        ).ravel()  # without what comes of the angle

    before, carried, stood = (
        gusts(view_direction)
        for view_direction in (seen_from(context), seen_from(context, 200.0, gone), seen_from(context, 200.0))
    )
    assert np.corrcoef(before, carried)[0, 1] > 0.98
    assert np.corrcoef(before, stood)[0, 1] < 0.5


SKY_K, WATER_K, WIND = 250.0, 290.0, 8.0


def of_all_seen(down_rad: float) -> Floats:
    """(mean, sigma) of the radiance of all facets that are seen `down_rad` below the horizon: a Gaussian of grazing
    angles, each weighted by the area that it turns to the camera, summed up."""
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
    return np.stack([layer.light(seen_from(context, time))[1] for time in (0.0, 40.0, 80.0, 120.0)])


@pytest.mark.parametrize("down_deg", [2.0, 4.0, 10.0, 30.0])
def test_the_sea_is_as_light_where_waves_are_drawn_as_where_none_is(down_deg: float) -> None:
    """From 10 km up none is drawn, from 10 m up the six octaves: half of the slopes' variance."""
    exact, spread = of_all_seen(math.radians(down_deg))
    far, near = water(down_deg, FAR_M, 3), water(down_deg, 10.0, 3)
    assert far.mean() == pytest.approx(exact, rel=0.01)
    assert near.mean() == pytest.approx(exact, rel=0.02)
    assert far.std() < 0.25 * spread
    assert 0.2 * spread < near.std() < 0.9 * spread


def test_facets_that_are_seen_are_those_that_turn_to_the_camera() -> None:
    """Against sums over Gaussians: sqrt(pi / 2) spreads where half lean away; all of them where they all face it."""
    spread = 0.1
    for mean in (-0.1, -0.05, 0.0, 0.05, 0.2, 1.0):
        grazing = np.maximum(mean + spread * np.linspace(-6, 6, 4001), 0)
        weights = grazing * np.exp(-(np.linspace(-6, 6, 4001) ** 2) / 2)
        middle = np.average(grazing, weights=weights)
        variance = np.average((grazing - middle) ** 2, weights=weights)
        seen, left = facing(np.array([mean]), np.array([spread**2]))
        assert seen[0] == pytest.approx(middle, rel=0.12)
        if mean >= 0:
            assert left[0] == pytest.approx(variance / spread**2, abs=0.06)
    assert facing(np.zeros(1), np.array([spread**2]))[0][0] == pytest.approx(spread * math.sqrt(math.pi / 2))
    assert [float(each[0]) for each in facing(np.array([0.2]), np.zeros(1))] == [0.2, 1.0]  # a mirror


def test_facets_that_mirror_other_water_show_no_sky() -> None:
    """Seen 23 degrees below the horizon, facets of less than 11.5 degrees reflect what is below it: no cold zenith."""
    context = SceneContext(1, Geometry((17, 17), 0.5e-3, math.radians(-23.0)), 30.0, "lwir", 0.0)
    water = Sea(horizon_k=288, zenith_k=200, water_k=288).layers(context)[0]
    assert isinstance(water, SeaSurface)
    steep, shallow = np.radians([[20.0]], dtype=np.float32), np.radians([[1.0, 5.0, 11.0]], dtype=np.float32)
    down = np.radians([[23.0]], dtype=np.float32)
    sky = float(radiance("lwir", 288))
    assert water._mirrored(steep, down).item() < -1e-3 * sky
    np.testing.assert_allclose(water._mirrored(shallow, np.broadcast_to(down, (1, 3))), 0, atol=1e-5 * sky)
