"""The atmosphere in images: the radiance of targets, ground, sea and clouds at the camera."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from irsim.backgrounds.air import ground_path, horizon_m
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.radiometry import radiance, temperature
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario


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


def test_an_atmosphere_needs_a_fitted_band() -> None:
    camera = {"band": (5.2, 7.0)}
    with pytest.raises(ValidationError, match=r"no atmosphere is fitted to a band of 5.2 to 7 um"):
        scene(camera=camera)
    assert scene(camera=camera, atmosphere={}).camera.band == (5.2, 7.0)


def test_a_target_is_attenuated_and_has_path_radiance() -> None:
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
    mixed = 0.6 * radiance("mwir", 300.0) + 0.4 * grey.context.surroundings
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


def test_the_sky_of_a_preset_is_the_background() -> None:
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


@pytest.mark.parametrize(
    ("air", "elevation_deg", "ifov_mrad"),
    [
        ({"preset": "tropical", "visibility_km": 5.0}, 3.0, 1.0),
        ({"preset": "us_standard", "fog_visibility_km": 1.0}, 12.0, 2.0),
    ],
)
def test_each_row_of_a_cloud_is_attenuated_on_its_ray(
    air: dict[str, Any], elevation_deg: float, ifov_mrad: float
) -> None:
    """An even cloud of 270 K that hides all, 3 km off; 200 m up a fog ends, at 3.8 degrees. To 0.02 K, and half of what
    the air does from one pixel to the next."""
    cloud = {"coverage": 0.999999, "depth": 1e4, "texture_k": 0.0, "temperature_k": 270.0, "range_m": 3000.0}
    sky = {"kind": "sky", "clouds": [{**cloud, "evolve_s": 20.0}]}
    camera = {
        "size": (32, 400),
        "ifov_mrad": ifov_mrad,
        "elevation_deg": elevation_deg,
        "band": "lwir",
        "netd_mk": 0.0,
        "motion": [{"kind": "pan", "azimuth_deg_s": 3.0, "elevation_deg_s": 6.0}],
    }
    scenario = scene(camera=camera, atmosphere=air, background=sky, targets=[], frames=31)
    renderer = Renderer(scenario)
    for frame in (0, 30):
        pose = renderer.pose(frame)
        middle = np.stack([np.full(400, 20.0), np.arange(400.0)], axis=-1)
        elevations = -np.arcsin(pose.lens.directions(middle) @ pose.rotation @ pose.context.geometry.down)
        emitted = radiance("lwir", np.full(400, 270.0))
        wanted = scenario.air.through("lwir", emitted, np.ones(400), 3000.0, elevations)
        found, expected = (temperature("lwir", light) for light in (renderer.scene(frame)[0][:, 20], wanted))
        assert np.abs(found - expected).max() < 0.02 + np.abs(np.diff(expected)).max() / 2
        assert np.ptp(expected) > 0.2


@pytest.mark.parametrize(("degrees", "height_m", "range_m"), [(30, 100, 200), (45, 1000, 1414.2)])
def test_ground_lies_where_the_ray_falls(degrees: float, height_m: float, range_m: float) -> None:
    along, elevation = ground_path(height_m, np.radians(degrees))
    assert along == pytest.approx(range_m, rel=2e-5)
    assert elevation == pytest.approx(-np.radians(degrees))
    assert horizon_m(100.0) == pytest.approx(35.70e3, abs=10)  # sqrt(2 * 6371 km * 0.1 km)


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
    assert abs(middle[:99]).max() < 1e-3
    water = temperature("lwir", hazy[100:, 32])
    assert water[1] == pytest.approx(float(temperature("lwir", hazy[97, 32])), abs=1.5)
    below = np.arctan(0.0805)  # row 180
    tau, path = Atmosphere(preset="tropical").path("lwir", 100 / np.sin(below), -below)
    assert hazy[180, 32] == pytest.approx(float(tau * bare[180, 32] + path), rel=1e-3)
