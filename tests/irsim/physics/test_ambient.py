"""Surroundings reflected by bodies: those of the air where given, else the background's own sky and ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scipy import integrate

from irsim import Scenario
from irsim.backgrounds import Background, Ground, Layer
from irsim.geometry.context import SceneContext
from irsim.physics.radiometry import radiance, temperature
from irsim.render.frame import Renderer
from irsim.types import Band

BAND: Band = "lwir"


class Bare(Background):
    """A user's own kind without surroundings."""

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        return Ground().layers(context)


def scene(background: dict[str, Any], **more: Any) -> Scenario:
    camera = {
        "size": (64, 48),
        "band": BAND,
        "ifov_mrad": 0.05,
        "psf_px": 0.0,
        "netd_mk": 0.0,
        **more.pop("camera", {}),
    }
    return Scenario.model_validate({"frames": 2, "camera": camera, "background": background, **more})


def around_k(scenario: Scenario) -> float:
    return float(temperature(BAND, scenario.context.surroundings))


def sky_mean(horizon_k: float, zenith_k: float) -> float:
    """Mean over its directions of the sky's stated gradient, exp(-sin(elevation) / 0.3), by another rule."""

    def seen(elevation: float) -> float:
        kelvin = zenith_k + (horizon_k - zenith_k) * np.exp(-np.sin(elevation) / 0.3)
        return float(radiance(BAND, kelvin) * np.cos(elevation))

    return float(integrate.quad(seen, 0, np.pi / 2, epsrel=1e-8)[0])


@pytest.mark.parametrize(
    ("background", "below_k"),
    [
        ({"kind": "sky", "horizon_k": 280.0, "zenith_k": 230.0}, 280.0),
        ({"kind": "landscape", "horizon_k": 280.0, "zenith_k": 230.0, "ground_k": 300.0}, 300.0),
        ({"kind": "sea", "horizon_k": 280.0, "zenith_k": 230.0, "water_k": 290.0}, 290.0),
    ],
)
def test_surroundings_are_half_sky_and_half_ground(background: dict[str, Any], below_k: float) -> None:
    half = (sky_mean(280.0, 230.0) + float(radiance(BAND, below_k))) / 2
    assert scene(background).context.surroundings == pytest.approx(half, rel=1e-5)


def test_ground_and_default_surroundings() -> None:
    assert around_k(scene({"kind": "ground", "mean_k": 301.0})) == pytest.approx(301.0, abs=1e-6)
    assert around_k(scene({"kind": "test_ambient:Bare"})) == pytest.approx(288.15, abs=1e-6)


@pytest.mark.parametrize("air", [{"surroundings_k": 250.0}, {"preset": "us_standard"}])
def test_the_air_overrules_the_background(air: dict[str, Any]) -> None:
    one, other = (scene({"kind": "ground", "mean_k": kelvin}, atmosphere=air) for kelvin in (280.0, 300.0))
    assert one.context.surroundings == other.context.surroundings == one.air.surroundings(BAND)


def test_a_grey_body_in_equilibrium_has_no_contrast() -> None:
    """Kirchhoff: inside of walls of one temperature nothing stands out, whatever its emissivity."""
    car = {
        "kind": "car",
        "temperature_k": 295.0,
        "emissivity": 0.4,
        "engine_k": 295.0,
        "windows_k": 295.0,
        "wheels_k": 295.0,
    }
    target = {"id": "car", "shape": car, "path": {"kind": "straight", "start": (32, 24), "speed": 0, "range_m": 3000}}
    flat = {"kind": "ground", "mean_k": 295.0, "spread_k": 0.0}
    light = Renderer(scene(flat, targets=[target])).scene(0)[0]
    assert np.ptp(light) / light.mean() < 1e-5
    shown = Renderer(scene(flat, targets=[target], atmosphere={"surroundings_k": 250.0})).scene(0)[0]
    assert np.ptp(shown) / shown.mean() > 0.1
