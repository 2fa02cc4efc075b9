"""The sea and its wind: how fast and where to its waves and gusts run, and how facets lean at grazing angles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irsim.backgrounds import Gaze, Sea
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.sea import reflectance, slope_variance
from irsim.backgrounds.waves import Octave
from irsim.geometry import Geometry
from irsim.radiometry import radiance
from irsim.stage import Stage
from irsim.types import Floats

FAR_M = 10_000.0
"""From so high a pixel is far wider than the longest wave: none is drawn, all roughen the surface within a pixel."""


def seen_from(stage: Stage, time: float = 0.0, place: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Gaze:
    return Gaze(time, Chart.at(stage.geometry, stage.geometry.world_rotation(np.zeros(3))), place=place)


@pytest.mark.parametrize("wind_deg", [0.0, 90.0, 200.0])
def test_waves_run_with_the_wind_as_fast_as_on_deep_water(wind_deg: float) -> None:
    """At 10 m/s the longest take their 7.3 s for their 83 m (Pierson and Moskowitz): after a second the water is most
    like that before moved so far along the wind. Each train runs a little to its own side, c cos(side) along the wind,
    and crests square to its way pass along the wind at c / cos(side): within 7 %."""
    right, ahead = np.meshgrid(np.arange(0, 4000, 11, dtype=np.float32), np.arange(0, 4000, 11, dtype=np.float32))
    octave, angle = Octave(10.0, wind_deg, 0, 1), math.radians(wind_deg)
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
    stage, angle = Stage(1, Geometry((81, 61), 5e-3, math.radians(-40.0)), 30.0, "lwir", 0.0), math.radians(wind_deg)
    (water,) = Sea(wind_m_s=6.0, wind_deg=wind_deg, camera_height_m=FAR_M).layers(stage)
    way_m = 6.0 * 200.0
    gone = (way_m * math.sin(angle), 0.0, way_m * math.cos(angle))

    def gusts(gaze: Gaze) -> Floats:
        light = water.light(gaze)[1]
        return np.asarray(light - light.mean(axis=1, keepdims=True)).ravel()  # without what comes of the angle

    before, carried, stood = (
        gusts(gaze) for gaze in (seen_from(stage), seen_from(stage, 200.0, gone), seen_from(stage, 200.0))
    )
    assert np.corrcoef(before, carried)[0, 1] > 0.98
    assert np.corrcoef(before, stood)[0, 1] < 0.5


@pytest.mark.parametrize("down_deg", [2.0, 10.0])
def test_facets_that_are_seen_at_grazing_angles_lean_towards_the_camera(down_deg: float) -> None:
    """By half the spread of slopes on an axis (Cox and Munk): rho of the sky there, and the water for what is left."""
    wind = 8.0
    stage = Stage(1, Geometry((17, 17), 0.5e-3, -math.radians(down_deg)), 30.0, "lwir", 0.0)
    sea = Sea(wind_m_s=wind, gusts=0.0, camera_height_m=FAR_M, horizon_k=250, zenith_k=250, water_k=290)
    light = sea.layers(stage)[0].light(seen_from(stage))[1][8, 8]
    facet = math.radians(down_deg) + 0.5 * math.sqrt(slope_variance(wind) / 2)
    share = float(reflectance("lwir", np.array(facet)))
    expected = share * float(radiance("lwir", 250)) + (1 - share) * float(radiance("lwir", 290))
    assert light == pytest.approx(expected, rel=2e-3)
