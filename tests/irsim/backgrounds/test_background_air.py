"""Air before far ground and sea: that before a target as far away, up to one horizon."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from irsim.physics.radiometry import radiance, temperature
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import BandName, Floats

AIR = {"preset": "us_standard"}
GROUND = {"kind": "ground", "spread_k": 0.0, "mean_k": 310.0}
LANDSCAPE = {"kind": "landscape", "preset": "us_standard", "spread_k": 0.0, "ground_k": 310.0, "hills_mrad": 0.0}
SEA = {"kind": "sea", "preset": "us_standard", "gusts": 0.0}


def scene(background: dict[str, Any], air: dict[str, Any] = AIR, *targets: Any, **camera: Any) -> Scenario:
    sharp = {"size": (161, 121), "ifov_mrad": 0.05, "netd_mk": 0.0, "psf_px": 0.0, "band": "lwir", **camera}
    value = {"frames": 1, "camera": sharp, "background": background, "atmosphere": air, "targets": targets}
    return Scenario.model_validate(value)


@pytest.mark.parametrize("band", ["lwir", "mwir"])
@pytest.mark.parametrize("range_m", [20e3, 82e3])
@pytest.mark.parametrize("height_m", [10.0, 3000.0])
@pytest.mark.parametrize("background", [{**GROUND, "height_m": 0.0}, {**LANDSCAPE, "camera_height_m": 0.0}])
def test_a_target_as_warm_as_its_ground_has_no_contrast(
    background: dict[str, Any], height_m: float, range_m: float, band: BandName
) -> None:
    """A black patch two pixels high of 310 K on black ground of 310 K: to 0.02 K. The ground is up to 5.8 K warmer in
    the air of 20 km than in that of 82."""
    depression = math.asin(height_m / range_m)
    size_m = range_m * 4e-5
    shape = {"kind": "hot_spot", "temperature_k": 310.0, "emissivity": 1.0, "size_m": (4 * size_m, size_m)}
    path = {"kind": "straight", "start": (80.0, 60.0), "speed": 0.0, "range_m": range_m}
    key = next(key for key, value in background.items() if value == 0.0 and key.endswith("height_m"))
    patch = {"id": "patch", "shape": shape, "path": path}
    camera = {"elevation_deg": -math.degrees(depression), "band": band, "ifov_mrad": 0.02}
    light, truth = Renderer(scene({**background, key: height_m}, AIR, patch, **camera)).scene(0)
    assert truth.targets[0].contrast_k == pytest.approx(0, abs=0.02)
    air = scene({**background, key: height_m}).context.air
    arrives = air.through(band, radiance(band, 310.0), np.ones(1), range_m, -depression)
    assert temperature(band, light[60, 20]) == pytest.approx(float(temperature(band, arrives)[0]), abs=0.02)


def passed(**sea: Any) -> tuple[Scenario, Floats]:
    """(rows,): what the air before a sea passes, by what its light rises by when the water grows warmer, with the air
    and without."""
    scenario = scene({**SEA, **sea})
    rises = [
        np.subtract(*(Renderer(scene({**SEA, **sea, "water_k": kelvin}, air)).scene(0)[0] for kelvin in (300.0, 280.0)))
        for air in (AIR, {})
    ]
    with np.errstate(invalid="ignore"):
        return scenario, np.asarray(rises[0].mean(axis=1) / rises[1].mean(axis=1))


@pytest.mark.parametrize("height_m", [15.0, 100.0])
def test_the_sea_has_the_air_of_a_target_on_it(height_m: float) -> None:
    """Row for row up to 80 km away, with nothing to be seen of the dip of the round Earth's horizon: from 15 m that is
    2.2 mrad below the level, 43 px here."""
    scenario, found = passed(camera_height_m=height_m)
    depressions = np.arctan((np.arange(121) - 60) * 0.05e-3)
    near = depressions > height_m / 80e3
    range_m = height_m / np.sin(depressions[near])
    expected = scenario.context.air.transmittance("lwir", range_m, -depressions[near])
    assert range_m.max() > 60e3
    np.testing.assert_allclose(found[near], expected, atol=2e-3)


@pytest.mark.parametrize(("height_m", "band"), [(5.0, "lwir"), (100.0, "mwir")])
def test_the_sea_has_one_horizon(height_m: float, band: BandName) -> None:
    """At the level it grows out of the sky, to 0.2 K from the last row above it to the first below, and from there the
    air clears all the way down, without a band."""
    sea = {"camera_height_m": height_m, "wind_m_s": 2.0}
    kelvin = temperature(band, Renderer(scene({**SEA, **sea}, band=band)).scene(0)[0].mean(axis=1))
    assert kelvin[61] == pytest.approx(kelvin[59], abs=0.2)
    assert (np.diff(passed(**sea)[1][62:]) >= -1e-4).all()


@pytest.mark.parametrize(("height_m", "fades"), [(10.0, True), (10_000.0, False)])
def test_hills_fade_into_the_sky_seen_from_low(height_m: float, fades: bool) -> None:
    """They are as far away as the farthest ground: seen from low through all of the air, as the sky is."""
    country = {**LANDSCAPE, "hills_mrad": 0.5, "camera_height_m": height_m}
    plain = {**country, "hills_mrad": 0.0}
    light = [temperature("lwir", Renderer(scene(each)).scene(0)[0]) for each in (country, plain)]
    rises = np.abs(light[0] - light[1])[:58]
    assert rises.max() < 1 if fades else rises.max() > 10
