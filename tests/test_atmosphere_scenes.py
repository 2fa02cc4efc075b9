"""The air in pictures: what arrives of targets, ground, sea and clouds; warnings beyond the fit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from irsim.atmosphere import Atmosphere
from irsim.backgrounds.air import ground_range_m
from irsim.cli import check
from irsim.doubts import doubts
from irsim.loader import warnings
from irsim.radiometry import radiance, temperature
from irsim.render import Renderer
from irsim.scenario import Scenario


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


def test_things_beyond_the_fit_are_told_too() -> None:
    """Whatever stands at a range of its own: a pole too near, cloud, trees and houses too far."""
    pole = {"kind": "bar", "range_m": 300.0, "center_px": (32.0, 24.0), "size_px": (9.0, 9.0)}
    (near,) = doubts(scene(occluders=[pole]))
    assert near == (("occluders", 0, "range_m"), "a range of 0.3 km lies beyond the fitted 0.5 to 20 km")
    for family in ("clouds", "trees", "buildings"):
        country = {"kind": "landscape", "preset": "us_standard", family: [{"id": "ok"}, {"id": "far", "range_m": 4e4}]}
        (far,) = doubts(scene(background=country, camera={"elevation_deg": -2.0}))
        assert far == (("background", family, 1, "range_m"), "a range of 40 km lies beyond the fitted 0.5 to 20 km")


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
    mixed = 0.6 * radiance("mwir", 300.0) + 0.4 * grey.stage.surroundings
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
    wet = {"preset": "none", "rain_mm_h": 5.0, "fog_visibility_km": 1.0}
    (notice,) = doubts(scene(atmosphere=wet, background={"kind": "sky"}))
    assert "of its own temperatures behind rain and fog of 288 K" in notice.what


@pytest.mark.parametrize(
    ("background", "range_k", "told"),
    [
        ({"kind": "ground", "mean_k": 330, "spread_k": 2}, (250, 310), ["ground above"]),
        ({"kind": "ground", "mean_k": 250, "spread_k": 1}, (270, 310), ["ground below"]),
        ({"kind": "ground", "mean_k": 310, "spread_k": 3}, (250, 310), []),
        ({"kind": "landscape", "ground_k": 330}, (200, 310), ["ground above"]),
        (
            {"kind": "landscape", "ground_k": 330, "horizon_k": 340, "zenith_k": 340},
            (200, 310),
            ["clear sky above", "ground above"],
        ),
        ({"kind": "landscape", "ground_k": 290}, (200, 310), []),
        (
            {"kind": "sea", "water_k": 275, "horizon_k": 270, "zenith_k": 270},
            (280, 310),
            ["clear sky below", "sea below"],
        ),
    ],
)
def test_a_ground_that_no_count_can_tell_is_told(
    background: dict[str, Any], range_k: tuple[float, float], told: list[str]
) -> None:
    camera = {"size": (64, 48), "ifov_mrad": 1.0, "range_k": range_k}
    found = [notice.what for notice in doubts(scene(camera=camera, atmosphere={}, background=background))]
    found = [line for line in found if line.startswith("all of the ")]
    assert [
        f"{line.split(',')[0].removeprefix('all of the ')} {line.split('lies ')[1].split(':')[0]}" for line in found
    ] == told


@pytest.mark.parametrize(("elevation", "what"), [(-5, "ground"), (0, "clear sky"), (5, "clear sky")])
def test_of_a_landscape_only_what_is_in_the_picture_is_told(elevation: float, what: str) -> None:
    """It is 2.7 degrees high."""
    camera = {"size": (64, 48), "ifov_mrad": 1.0, "range_k": (300, 310), "elevation_deg": elevation}
    land = {"kind": "landscape", "ground_k": 290 if elevation < 0 else 305, "horizon_k": 280, "zenith_k": 280}
    lines = [notice.what for notice in doubts(scene(camera=camera, atmosphere={}, background=land))]
    (line,) = [line for line in lines if "its pixels are" in line]
    assert line.startswith(f"all of the {what}, ")


def test_a_sky_that_no_count_can_tell_is_told() -> None:
    """The picture reaches from 8.6 to 11.4 degrees: the sky is 245 + 45 exp(-sin / 0.3), 268.3 to 272.3 K."""
    sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}

    def told(range_k: tuple[float, float], **detector: Any) -> list[str]:
        camera = {"size": (64, 48), "ifov_mrad": 1.0, "elevation_deg": 10, "range_k": range_k, **detector}
        return [notice.what for notice in doubts(scene(camera=camera, atmosphere={}, background=sky))]

    assert told((220, 268)) == ["all of the clear sky, 268 to 272 K, lies above: its pixels are full"]
    assert told((273, 300)) == ["all of the clear sky, 268 to 272 K, lies below: its pixels are at count 0"]
    assert told((220, 269)) == told((272, 300)) == []
    (other,) = told((220, 268), detector={"kind": "electrons"})
    assert other.startswith("does not count for a detector of kind electrons")
    longwave = told((220, 400), detector={"kind": "electrons"}, band="lwir")  # its well is full after 10 ms
    assert "all of the clear sky, 268 to 272 K, lies above: its pixels are full" in longwave


def test_a_cloud_colder_than_the_sky_behind_it_is_told() -> None:
    """The picture reaches down to 10 degrees: there the sky is 245 + 45 exp(-sin 10 / 0.3) = 270.2 K."""
    camera = {"size": (64, 48), "ifov_mrad": 1.0, "elevation_deg": 10 + np.degrees(np.arctan(0.024))}

    def told(temperature_k: float, **other: Any) -> list[Any]:
        clouds = [{"id": "high", "temperature_k": 290}, {"id": "low", "temperature_k": temperature_k}]
        sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245, "clouds": clouds}
        return list(doubts(scene(**{"camera": camera, "atmosphere": {}, "background": sky, **other})))

    (notice,) = told(265.1)
    assert notice.at == ("background", "clouds", 1, "temperature_k")
    assert notice.what.startswith("low looks 265 K, colder than the clear sky of 270 K behind it low in the picture")
    assert "at 10.0 degrees" in notice.what
    assert told(265.3) == []  # the sky's own figures are good to 5 K
    assert told(200.0, camera={**camera, "elevation_deg": -20}) == []


def test_through_air_a_cloud_as_warm_as_the_air_is_warmer_than_the_sky() -> None:
    """At 4 km and 3 degrees it is 310 m high: the US standard atmosphere of 1976 has 286.1 K there (288.15 - 6.5 z)."""
    for kelvin, warned in ((286.0, False), (230.0, True)):
        sky = {"kind": "sky", "preset": "us_standard", "clouds": [{"temperature_k": kelvin, "range_m": 4000}]}
        camera = {"size": (64, 48), "elevation_deg": 3}
        assert bool(list(doubts(scene(camera=camera, background=sky, targets=[])))) == warned


@pytest.mark.parametrize(
    ("air", "elevation_deg", "ifov_mrad"),
    [
        ({"preset": "us_standard"}, 10.0, 0.5),
        ({"preset": "tropical", "visibility_km": 5.0}, 3.0, 1.0),
        ({"preset": "us_standard", "fog_visibility_km": 1.0}, 12.0, 2.0),
        ({"preset": "us_standard", "rain_mm_h": 5.0}, -4.0, 0.5),
    ],
)
@pytest.mark.parametrize("evolve_s", [0.0, 20.0])
def test_each_row_of_a_cloud_is_seen_through_the_air_on_its_way(
    air: dict[str, Any], elevation_deg: float, ifov_mrad: float, evolve_s: float
) -> None:
    """An even cloud of 270 K that hides all, 3 km off; 200 m up a fog ends, at 3.8 degrees. To 0.02 K, and half of what
    the air does from one pixel to the next."""
    cloud = {"coverage": 0.999999, "depth": 1e4, "texture_k": 0.0, "temperature_k": 270.0, "range_m": 3000.0}
    sky = {"kind": "sky", "clouds": [{**cloud, "evolve_s": evolve_s}]}
    camera = {
        "size": (64, 400),
        "ifov_mrad": ifov_mrad,
        "elevation_deg": elevation_deg,
        "band": "lwir",
        "netd_mk": 0.0,
        "motion": [{"kind": "pan", "azimuth_deg_s": 3.0, "elevation_deg_s": 6.0}],
    }
    scenario = scene(camera=camera, atmosphere=air, background=sky, targets=[], frames=31)
    renderer = Renderer(scenario)
    for frame in (0, 30):
        sight = renderer.sight(frame)
        middle = np.stack([np.full(400, 20.0), np.arange(400.0)], axis=-1)
        elevations = -np.arcsin(sight.lens.directions(middle) @ sight.rotation @ sight.stage.geometry.down)
        emitted = radiance("lwir", np.full(400, 270.0))
        wanted = scenario.air.through("lwir", emitted, np.ones(400), 3000.0, elevations)
        found, expected = (temperature("lwir", light) for light in (renderer.scene(frame)[0][:, 20], wanted))
        assert np.abs(found - expected).max() < 0.02 + np.abs(np.diff(expected)).max() / 2
        assert np.ptp(expected) > 0.2


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
    (idle,) = warnings(file, ["atmosphere.preset=none"])
    assert idle.startswith(f"{file}:5:18: atmosphere.visibility_km: warning: does not count without a preset")
    check([str(file)])
    printed = capsys.readouterr()
    assert printed.out == f"{file}: ok\n"
    assert printed.err.splitlines() == [hazy, far]


def test_the_atmosphere_is_switched_off_by_name() -> None:
    off = scene(without=["atmosphere"])
    none = scene(atmosphere={})
    assert np.array_equal(Renderer(off).frame(1)[0].image, Renderer(none).frame(1)[0].image)
    assert not np.array_equal(Renderer(scene()).frame(1)[0].image, Renderer(none).frame(1)[0].image)


def test_features_wider_than_a_clouds_period_are_told() -> None:
    """60 mrad are 1,000 px at 0.06 mrad and 1,200 at 0.05; textures of so small a picture repeat after 1,024."""

    def told(ifov_mrad: float) -> list[Any]:
        clouds = [{"id": "a", "temperature_k": 290, "correlation_mrad": 60}]
        sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245, "clouds": clouds}
        camera = {"size": (64, 48), "ifov_mrad": ifov_mrad, "elevation_deg": 10}
        return list(doubts(scene(camera=camera, atmosphere={}, background=sky)))

    assert told(0.06) == []
    (notice,) = told(0.05)
    assert notice.at == ("background", "clouds", 0, "correlation_mrad")
    assert all(words in notice.what for words in ("1200 px", "1024 px", "51.2 mrad"))


@pytest.mark.parametrize(
    ("elevation_deg", "columns", "motion", "at", "words"),
    [
        (73, 64, (), None, ""),
        (74.8, 64, (), "elevation_deg", "frame 0: the picture comes within 14 degrees"),
        (-74.8, 64, (), "elevation_deg", "within 14 degrees of the zenith or the nadir"),
        (0, 1100, (), None, ""),
        (0, 1200, (), "ifov_mrad", "the picture is 62 degrees wide: beyond 60"),
        (70, 64, ({"kind": "pan", "elevation_deg_s": 6},), "elevation_deg", "frame 9: the picture comes within"),
    ],
)
def test_pictures_that_no_map_holds_are_told(
    elevation_deg: float, columns: int, motion: tuple[Any, ...], at: str | None, words: str
) -> None:
    """Half a height of 24 px of 1 mrad is 1.4 degrees: 75 degrees are reached from 73.6 on."""
    camera = {"size": (columns, 48), "ifov_mrad": 1.0, "elevation_deg": elevation_deg, "motion": motion, "rate_hz": 10}
    background = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}
    found = [
        (notice.at, notice.what)
        for notice in doubts(scene(camera=camera, atmosphere={}, background=background, frames=10))
    ]
    assert [place for place, _ in found] == ([("camera", at)] if at else [])
    assert all(words in what for _, what in found)
