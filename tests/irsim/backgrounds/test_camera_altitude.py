"""Altitude of the camera: one value for all atmosphere of a scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from irsim import Scenario
from irsim.backgrounds.air import ground_path
from irsim.lint import ineffective, lint
from irsim.physics.radiometry import radiance, temperature
from irsim.render.frame import Renderer

AIR = {"preset": "tropical", "temperature_k": 280.0}
GROUND = {"kind": "ground", "spread_k": 0.0, "mean_k": 320.0}
LANDSCAPE = {"kind": "landscape", "spread_k": 0.0, "ground_k": 320.0}
SEA = {"kind": "sea", "wind_m_s": 0.0}


def scene(background: dict[str, Any], **more: Any) -> Scenario:
    camera = {"size": (65, 49), "ifov_mrad": 0.5, "elevation_deg": -30.0, "band": "lwir", "psf_px": 0.0}
    return Scenario.model_validate(
        {"frames": 2, "camera": camera, "background": background, "atmosphere": AIR, **more},
    )


@pytest.mark.parametrize(
    ("background", "given", "altitude_m"),
    [
        ({"kind": "sky"}, {}, 100.0),
        ({"kind": "sky"}, {"altitude_m": 0.0}, 0.0),
        (GROUND, {"altitude_m": 40.0}, 40.0),
        ({**GROUND, "height_m": 30.0}, {}, 100.0),
        ({**GROUND, "height_m": 3000.0}, {}, 3000.0),
        ({**GROUND, "height_m": 3000.0}, {"altitude_m": 500.0}, 3000.0),
        ({**GROUND, "height_m": 3000.0}, {"altitude_m": 4000.0}, 4000.0),
        ({**LANDSCAPE, "camera_height_m": 3000.0}, {"altitude_m": 500.0}, 3000.0),
        ({**SEA, "camera_height_m": 15.0}, {}, 15.0),
        ({**SEA, "camera_height_m": 15.0}, {"altitude_m": 500.0}, 15.0),
    ],
)
def test_the_background_sets_the_altitude(
    background: dict[str, Any], given: dict[str, float], altitude_m: float
) -> None:
    """With a warning if another altitude is given."""
    scenario = scene(background, atmosphere={**AIR, **given})
    assert scenario.context.air.altitude_m == altitude_m
    said = [notice for notice in lint(scenario) if notice.at == ("atmosphere", "altitude_m")]
    assert said == [notice for notice in ineffective(scenario) if notice.at == ("atmosphere", "altitude_m")]
    assert len(said) == (given.get("altitude_m", altitude_m) != altitude_m)
    for notice in said:
        assert notice.message.startswith(f"500 m does not count: the camera is {altitude_m:g} m above the ")
    for change in ({"atmosphere": {**AIR, **given}, "without": ["atmosphere"]}, {"atmosphere": given}):
        assert not list(ineffective(scene(background, **change)))


@pytest.mark.parametrize(
    ("background", "what"),
    [({**GROUND, "height_m": 49_000.0}, "ground"), ({**SEA, "camera_height_m": 21_000.0}, "sea")],
)
def test_a_camera_above_the_air_is_refused_with_an_atmosphere(background: dict[str, Any], what: str) -> None:
    height_m = background.get("height_m") or background["camera_height_m"]
    with pytest.raises(
        ValidationError, match=f"{height_m:g} m above the {what}; allowed with an atmosphere: up to 20000"
    ):
        scene(background)
    assert scene(background, atmosphere={}).context.air.is_clear


def test_ground_above_the_horizon_is_as_far_as_it() -> None:
    """At 100 km, or at the Earth's horizon, sqrt(2 r h + h^2), if that is farther."""
    for height_m in (*np.arange(1.0, 200.0), 780.0, 800.0, 3000.0, 20_000.0, 400_000.0):
        farthest_m = max(math.sqrt(2 * 6.371e6 * height_m + height_m**2), 100e3)
        along, elevation = ground_path(height_m, np.array([0.9 * height_m / farthest_m, 0.0, -0.3]))
        np.testing.assert_allclose(along, farthest_m, rtol=1e-6)
        np.testing.assert_allclose(np.sin(elevation), -height_m / farthest_m, rtol=1e-6)


@pytest.mark.parametrize("background", [{**GROUND, "height_m": 3000.0}, {**LANDSCAPE, "camera_height_m": 3000.0}])
def test_ground_and_target_share_one_atmosphere(background: dict[str, Any]) -> None:
    """A black plate at the temperature and range of the ground is indistinguishable from it."""
    screen = {"kind": "bar", "center_px": (32.0, 24.0), "size_px": (9.0, 9.0), "range_m": 3000 / math.sin(math.pi / 6)}
    plate = {**screen, "temperature_k": 320.0, "emissivity": 1.0}
    light = Renderer(scene(background, occluders=[plate])).scene(0)[0]
    kelvin = temperature("lwir", light)
    assert kelvin[24, 32] == pytest.approx(kelvin[24, 26], abs=2e-3)
    thin = scene(background).air.through("lwir", radiance("lwir", 320.0), np.ones(1), screen["range_m"], -math.pi / 6)
    assert kelvin[24, 32] == pytest.approx(float(temperature("lwir", thin)[0]), abs=0.02)
