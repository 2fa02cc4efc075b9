"""Air before ground, sea, targets and occluders: one altitude, one horizon, and the range of the present frame."""

from __future__ import annotations

import math
from typing import Any

import carried
import numpy as np
import pytest
from pydantic import ValidationError

from irsim.backgrounds.air import ground_path
from irsim.lint import lint
from irsim.physics.radiometry import radiance, temperature
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.types import BandName

AIR = {"preset": "us_standard"}
GROUND = {"kind": "ground", "spread_k": 0.0, "mean_k": 310.0}
LANDSCAPE = {"kind": "landscape", "preset": "us_standard", "spread_k": 0.0, "ground_k": 310.0, "hills_mrad": 0.0}
SEA = {"kind": "sea", "preset": "us_standard", "gusts": 0.0}


def scene(background: dict[str, Any], air: dict[str, Any] = AIR, *targets: Any, **camera: Any) -> Scenario:
    sharp = {"size": (81, 121), "ifov_mrad": 0.05, "netd_mk": 0.0, "psf_px": 0.0, "band": "lwir", **camera}
    value = {"frames": 1, "camera": sharp, "background": background, "atmosphere": air, "targets": targets}
    return Scenario.model_validate(value)


@pytest.mark.parametrize(
    ("background", "height_m", "range_m", "band"),
    [
        ({**GROUND, "height_m": 3000.0}, 3000.0, 82e3, "lwir"),
        ({**LANDSCAPE, "camera_height_m": 10.0}, 10.0, 20e3, "mwir"),
        ({**LANDSCAPE, "camera_height_m": 3000.0}, 3000.0, 20e3, "lwir"),
    ],
)
def test_a_target_as_warm_as_its_ground_has_no_contrast(
    background: dict[str, Any], height_m: float, range_m: float, band: BandName
) -> None:
    """A black patch two pixels high of 310 K on black ground of 310 K: to 0.02 K."""
    depression, size_m = math.asin(height_m / range_m), range_m * 4e-5
    shape = {"kind": "hot_spot", "temperature_k": 310.0, "emissivity": 1.0, "size_m": (4 * size_m, size_m)}
    path = {"kind": "straight", "start": (40.0, 60.0), "speed": 0.0, "range_m": range_m}
    patch = {"id": "patch", "shape": shape, "path": path}
    scenario = scene(background, AIR, patch, elevation_deg=-math.degrees(depression), band=band, ifov_mrad=0.02)
    light, truth = Renderer(scenario).scene(0)
    assert truth.targets[0].contrast_k == pytest.approx(0, abs=0.02)
    arriving = scenario.context.air.through(band, radiance(band, 310.0), np.ones(1), range_m, -depression)
    assert temperature(band, light[60, 20]) == pytest.approx(float(temperature(band, arriving)[0]), abs=0.02)


def test_the_sea_has_one_horizon_and_the_air_of_a_target() -> None:
    """Sky and sea meet within 0.2 K, without the dip of the round Earth's horizon.

    The transmittance is the rise of the light with the temperature of the water, with air over without.
    """
    sea = {**SEA, "camera_height_m": 15.0, "wind_m_s": 2.0}
    warm, cold, warm_clear, cold_clear = (
        Renderer(scene({**sea, "water_k": kelvin}, air)).scene(0)[0].mean(axis=1)
        for air in (AIR, {})
        for kelvin in (300.0, 280.0)
    )
    apparent = temperature("lwir", cold)
    assert apparent[61] == pytest.approx(apparent[59], abs=0.4)
    found = (warm - cold)[62:] / (warm_clear - cold_clear)[62:]
    depressions = np.arctan((np.arange(62, 121) - 60) * 0.05e-3)
    near = depressions > 15.0 / 80e3
    range_m = 15.0 / np.sin(depressions[near])
    expected = scene(sea).context.air.transmittance("lwir", range_m, -depressions[near])
    assert range_m.max() > 60e3
    np.testing.assert_allclose(found[near], expected, atol=2e-3)
    assert (np.diff(found) >= -1e-4).all()


@pytest.mark.parametrize(("height_m", "fades"), [(10.0, True), (10_000.0, False)])
def test_hills_fade_into_the_sky_from_a_low_camera(height_m: float, fades: bool) -> None:
    light = [
        temperature(
            "lwir", Renderer(scene({**LANDSCAPE, "hills_mrad": hills, "camera_height_m": height_m})).scene(0)[0]
        )
        for hills in (0.5, 0.0)
    ]
    rises = np.abs(light[0] - light[1])[:58]
    assert rises.max() < 1 if fades else rises.max() > 10


@pytest.mark.parametrize(
    ("background", "given", "altitude_m"),
    [
        ({"kind": "sky"}, {}, 100.0),
        (GROUND, {"altitude_m": 40.0}, 40.0),
        ({**GROUND, "height_m": 3000.0}, {"altitude_m": 500.0}, 3000.0),
        ({**GROUND, "height_m": 3000.0}, {"altitude_m": 4000.0}, 4000.0),
        ({**LANDSCAPE, "camera_height_m": 3000.0}, {}, 3000.0),
        ({**SEA, "camera_height_m": 15.0}, {"altitude_m": 500.0}, 15.0),
    ],
)
def test_the_background_sets_the_altitude(
    background: dict[str, Any], given: dict[str, float], altitude_m: float
) -> None:
    """Another altitude is warned of."""
    scenario = scene(background, {**AIR, **given})
    assert scenario.context.air.altitude_m == altitude_m
    found = [notice for notice in lint(scenario) if notice.at == ("atmosphere", "altitude_m")]
    assert len(found) == (given.get("altitude_m", altitude_m) != altitude_m)
    assert all(f"500 m does not count: the camera is {altitude_m:g} m" in notice.message for notice in found)


@pytest.mark.parametrize(
    "background", [{**GROUND, "height_m": 49_000.0}, {**SEA, "preset": None, "camera_height_m": 21_000.0}]
)
def test_a_camera_above_the_air_is_refused(background: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=r"000 m above the .*; allowed with an atmosphere: up to 20000"):
        scene(background)
    assert scene(background, {}).context.air.is_clear


@pytest.mark.parametrize("height_m", [1.0, 150.0, 780.0, 3000.0, 400_000.0])
def test_ground_above_the_horizon_is_as_far_as_it(height_m: float) -> None:
    """At 100 km, or at the Earth's horizon, sqrt(2 r h + h^2), if that is farther."""
    farthest_m = max(math.sqrt(2 * 6.371e6 * height_m + height_m**2), 100e3)
    along, elevation = ground_path(height_m, np.array([0.9 * height_m / farthest_m, 0.0, -0.3]))
    np.testing.assert_allclose(along, farthest_m, rtol=1e-6)
    np.testing.assert_allclose(np.sin(elevation), -height_m / farthest_m, rtol=1e-6)


HOT = {"kind": "hot_spot", "size_m": (400.0, 400.0), "temperature_k": 400.0, "emissivity": 1.0}


def hot(height_m: float) -> Any:
    """Return a target 8 km ahead of the first place of the camera and `height_m` above it."""
    path = {"kind": "straight_m", "axes": "world", "start_m": (0.0, 8000.0, height_m), "velocity_m_s": (0, 0, 0)}
    return {"id": "hot", "shape": HOT, "path": path}


def level(velocity_m_s: tuple[float, float, float], altitude_m: float = 100.0, **changes: Any) -> Scenario:
    """Return a scene of a level camera in tropical air."""
    air = {"preset": "tropical", "altitude_m": altitude_m}
    camera = {"elevation_deg": 0.0, "band": "lwir"}
    return carried.scene({"kind": "sky"}, velocity_m_s, camera=camera, atmosphere=air, **changes)


def kelvin(scenario: Scenario, frame: int = 60) -> float:
    """Return the apparent temperature in the middle of the picture."""
    return float(temperature("lwir", Renderer(scenario).scene(frame)[0][60, 80]))


@pytest.mark.parametrize("climb_m", [6000.0, -90.0])
def test_targets_have_the_air_at_the_height_of_the_camera(climb_m: float) -> None:
    """After two seconds of climb as from a camera that was always at that height."""
    climbed = level((0.0, 0.0, climb_m / 2), targets=[hot(climb_m)])
    still = level((0.0, 0.0, 0.0), 100.0 + climb_m, targets=[hot(0.0)])
    assert kelvin(climbed) == pytest.approx(kelvin(still), abs=0.01)
    assert abs(kelvin(climbed) - kelvin(level((0.0, 0.0, 0.0), targets=[hot(0.0)]))) > 0.05


OCCLUDERS: dict[str, dict[str, Any]] = {
    "bar": {"center_px": (80, 60), "size_px": (20, 20), "emissivity": 1.0},
    "pole": {"foot_px": (80, 70), "height_px": 20.0, "width_px": 20.0, "emissivity": 1.0},
    "building": {"foot_px": (80, 70), "size_px": (20, 20), "windows": (0, 0), "emissivity": 1.0},
    "tree": {"foot_px": (80, 70), "height_px": 20.0, "crown_px": (18, 18), "spread_k": 0.0, "emissivity": 1.0},
    "smoke": {"center_px": (80, 60), "size_px": (40, 40), "opacity": 0.999, "spread_k": 0.0},
}


@pytest.mark.parametrize("kind", OCCLUDERS)
def test_occluders_have_the_air_of_their_present_range(kind: str) -> None:
    """2 km away at first, 100 m after two seconds."""
    occluder = {"kind": kind, "range_m": 2000.0, "temperature_k": 400.0, **OCCLUDERS[kind]}
    near = level((0.0, 950.0, 0.0), occluders=[occluder])
    tau, path = near.context.air.path("lwir", 100.0)
    expected = float(temperature("lwir", tau * radiance("lwir", 400.0) + path))
    assert expected == pytest.approx(395.7, abs=0.1)
    assert kelvin(near) == pytest.approx(expected, abs=0.1)
    assert kelvin(near, 0) == pytest.approx(353.7, abs=0.2)


def test_a_platform_at_rest_changes_no_bit() -> None:
    occluders = [{"kind": kind, "range_m": 2000.0, **keys} for kind, keys in OCCLUDERS.items()]
    resting = level((0.0, 0.0, 0.0), occluders=occluders, targets=[hot(0.0)])
    without = resting.model_copy(update={"camera": resting.camera.model_copy(update={"motion": ()})})
    np.testing.assert_array_equal(Renderer(resting).scene(60)[0], Renderer(without).scene(60)[0])
