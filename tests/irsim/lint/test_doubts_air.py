"""Warnings of the air, of sky and ground behind it, and of what lies beyond the fit."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_atmosphere_scenes import scene, target

from irsim.cli.app import check
from irsim.lint import doubts
from irsim.lint.warnings import warnings

CLOSING = target(400.0)["path"] | {"closing_m_s": -90.0}


@pytest.mark.parametrize(
    ("change", "place", "words"),
    [
        (
            {"targets": [target(400.0) | {"path": CLOSING}]},
            ("targets", 0, "path"),
            "frame 0: a range of 0.4 km lies beyond",
        ),
        ({"targets": [target(25e3)]}, ("targets", 0, "path", "range_m"), "a range of 25 km lies beyond the fitted 0.5"),
        ({"atmosphere": {"preset": "tropical", "visibility_km": 2}}, ("atmosphere", "visibility_km"), "2 km lies"),
        ({"atmosphere": {"preset": "tropical", "altitude_m": 3000}}, ("targets", 0, "path"), "holds 20% of the gas"),
        (
            {"camera": {"band": (3.4, 4.9)}},
            ("atmosphere", "preset"),
            "that of mwir is used, which may be off by up to 0.16",
        ),
    ],
)
def test_beyond_the_fit_is_told_with_its_place(change: dict[str, Any], place: tuple[str, ...], words: str) -> None:
    (notice,) = doubts(scene(**change))
    assert notice.at == place
    assert words in notice.message
    assert notice.message.startswith("a range") == (place[-1] == "range_m")


@pytest.mark.parametrize("band", ["mwir", "lwir", (3.0, 4.99), (3.05, 5.0), (8.05, 12.0)])
def test_a_band_whose_edges_make_less_than_the_fit_misses_is_not_told(band: Any) -> None:
    assert list(doubts(scene(camera={"band": band}))) == []


def test_things_beyond_the_fit_are_told_too() -> None:
    """Whatever stands at a range of its own: a pole too near, cloud, trees and houses too far."""
    pole = {"kind": "bar", "range_m": 300.0, "center_px": (25.0, 24.0), "size_px": (9.0, 9.0)}
    (near,) = doubts(scene(occluders=[pole]))
    assert near == (("occluders", 0, "range_m"), "a range of 0.3 km lies beyond the fitted 0.5 to 20 km")
    for family in ("clouds", "trees", "buildings"):
        country = {"kind": "landscape", "preset": "us_standard", family: [{"id": "ok"}, {"id": "far", "range_m": 4e4}]}
        (far,) = doubts(scene(background=country, camera={"elevation_deg": -2.0}))
        assert far == (("background", family, 1, "range_m"), "a range of 40 km lies beyond the fitted 0.5 to 20 km")


@pytest.mark.parametrize(
    ("altitude_m", "band", "words"),
    [
        (15e3, "lwir", None),
        (15e3, "mwir", None),
        (15e3, (7.7, 11.5), None),
        (15e3, (3.4, 4.9), None),
        (1000.0, (10.0, 12.0), None),
        (
            15e3,
            (10.0, 12.0),
            "has 0.0 times the share that lwir has, to which us_standard is fitted: its sky is too warm",
        ),
        (15e3, (9.0, 10.5), "too cold"),
        (15e3, (3.3, 4.15), "by carbon dioxide at 4.2 to 4.45 um, of which the camera's band has 0.0 times"),
    ],
)
def test_a_sky_above_the_water_in_a_band_without_its_gas_is_told(
    altitude_m: float, band: Any, words: str | None
) -> None:
    air, sky = {"preset": "us_standard", "altitude_m": altitude_m}, {"kind": "sky", "preset": "us_standard"}
    told = doubts(scene(atmosphere=air, background=sky, camera={"band": band}, targets=[]))
    found = [notice.message for notice in told if notice.at == ("atmosphere", "altitude_m")]
    assert len(found) == (words is not None)
    assert all(words in what for what in found if words is not None)


@pytest.mark.parametrize(
    ("height_m", "words"), [(300.0, []), (8000.0, ["in the middle of the picture: a path up to 8000 m above the sea"])]
)
def test_ground_beyond_the_fit_is_told(height_m: float, words: list[str]) -> None:
    ground = {"kind": "ground", "height_m": height_m, "spread_k": 0.0}
    air = {"preset": "us_standard", "altitude_m": height_m}
    told = doubts(scene(atmosphere=air, background=ground, camera={"elevation_deg": -30.0}, targets=[]))
    found = [notice.message for notice in told if notice.at == ("background", "kind")]
    assert len(found) == len(words)
    assert all(word in what for word, what in zip(words, found, strict=True))


def test_within_the_fit_nothing_is_told() -> None:
    assert list(doubts(scene())) == []
    assert list(doubts(scene(atmosphere={}, targets=[target(50e3)]))) == []


def test_a_sky_unlike_the_air_before_it_is_told() -> None:
    for sky, words in (({}, "of its own temperatures"), ({"preset": "tropical"}, "of tropical")):
        (notice,) = doubts(scene(background={"kind": "sky", **sky}))
        assert notice.at == ("background", "preset")
        assert words in notice.message
    assert list(doubts(scene(background={"kind": "sky", "preset": "us_standard"}))) == []
    wet = {"preset": "none", "rain_mm_h": 5.0, "fog_visibility_km": 1.0}
    (notice,) = doubts(scene(atmosphere=wet, background={"kind": "sky"}))
    assert "of its own temperatures behind rain and fog of 288 K" in notice.message


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
    found = [notice.message for notice in doubts(scene(camera=camera, atmosphere={}, background=background))]
    found = [line for line in found if line.startswith("all of the ")]
    assert [
        f"{line.split(',')[0].removeprefix('all of the ')} {line.split('lies ')[1].split(':')[0]}" for line in found
    ] == told


@pytest.mark.parametrize(("elevation", "what"), [(-5, "ground"), (0, "clear sky"), (5, "clear sky")])
def test_of_a_landscape_only_what_is_in_the_picture_is_told(elevation: float, what: str) -> None:
    """It is 2.7 degrees high."""
    camera = {"size": (64, 48), "ifov_mrad": 1.0, "range_k": (300, 310), "elevation_deg": elevation}
    land = {"kind": "landscape", "ground_k": 290 if elevation < 0 else 305, "horizon_k": 280, "zenith_k": 280}
    lines = [notice.message for notice in doubts(scene(camera=camera, atmosphere={}, background=land))]
    (line,) = [line for line in lines if "its pixels are" in line]
    assert line.startswith(f"all of the {what}, ")


def test_a_sky_that_no_count_can_tell_is_told() -> None:
    """The picture reaches from 8.6 to 11.4 degrees: the sky is 245 + 45 exp(-sin / 0.3), 268.3 to 272.3 K."""
    sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}

    def told(range_k: tuple[float, float], **detector: Any) -> list[str]:
        camera = {"size": (64, 48), "ifov_mrad": 1.0, "elevation_deg": 10, "range_k": range_k, **detector}
        return [notice.message for notice in doubts(scene(camera=camera, atmosphere={}, background=sky))]

    assert told((220, 268)) == [
        "all of the clear sky, 268 to 272 K, lies above: its pixels are full; range_k: [220, 280] holds it"
    ]
    assert told((273, 300)) == [
        "all of the clear sky, 268 to 272 K, lies below: its pixels are at count 0; range_k: [260, 300] holds it"
    ]
    assert told((220, 271.9)) == told((268.5, 300)) == told((220, 280)) == told((260, 300)) == []
    (other,) = told((220, 268), detector={"kind": "electrons"})
    assert other.startswith("does not count for a detector of kind electrons")
    longwave = told((220, 400), detector={"kind": "electrons"}, band="lwir")  # its well is full after 10 ms
    too_long = "all of the clear sky, 268 to 272 K, lies above: its pixels are full; try a shorter integration_ms"
    assert too_long in longwave


def test_a_sky_that_leaves_the_scale_in_part_of_the_picture_is_told() -> None:
    """The same sky: at half the height of the picture, 10 degrees, it has 270.2 K."""
    sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}
    camera = {"size": (64, 48), "ifov_mrad": 1.0, "elevation_deg": 10, "range_k": (270.2, 300)}
    (notice,) = doubts(scene(camera=camera, atmosphere={}, background=sky))
    part, rest = notice.message.split("% of the clear sky, 268 to 272 K, lies below, in ")
    assert rest == f"{part}% of the picture: its pixels are at count 0; range_k: [260, 300] holds it"
    assert 45 <= float(part) <= 55


def test_a_sea_whose_glint_fills_a_part_of_the_picture_with_full_counts_is_told() -> None:
    sun = {"kind": "sea", "camera_height_m": 20, "wind_m_s": 7, "sun_deg": (0, 20), "horizon_k": 285, "zenith_k": 230}

    def told(range_k: tuple[float, float] = (220, 400), **sea: Any) -> list[Any]:
        camera = {"size": (96, 72), "ifov_mrad": 1.0, "elevation_deg": -0.8, "netd_mk": 100, "range_k": range_k}
        return list(doubts(scene(camera=camera, atmosphere={}, background={**sun, **sea})))

    (notice,) = told()
    assert notice.at == ("camera", "range_k")
    found = re.fullmatch(
        r"(\d+)% of the sea, \d+ to \d+ K, lies above, in (\d+)% of the picture: its pixels are full; "
        r"range_k: \[220, (\d+)\] holds it",
        notice.message,
    )
    assert found is not None
    of_sea, of_picture, enough = map(int, found.groups())
    assert of_picture <= of_sea < 100
    assert of_picture >= 20
    assert told((220, enough)) == told(sun_deg=None) == told(sun_deg=(170, 20)) == []  # the last, behind the camera


def test_a_cloud_colder_than_the_sky_behind_it_is_told() -> None:
    """The picture reaches down to 10 degrees: there the sky is 245 + 45 exp(-sin 10 / 0.3) = 270.2 K."""
    camera = {"size": (64, 48), "ifov_mrad": 1.0, "elevation_deg": 10 + np.degrees(np.arctan(0.024))}

    def told(temperature_k: float, **other: Any) -> list[Any]:
        clouds = [{"id": "high", "temperature_k": 290}, {"id": "low", "temperature_k": temperature_k}]
        sky = {"kind": "sky", "horizon_k": 290, "zenith_k": 245, "clouds": clouds}
        return list(doubts(scene(**{"camera": camera, "atmosphere": {}, "background": sky, **other})))

    (notice,) = told(265.1)
    assert notice.at == ("background", "clouds", 1, "temperature_k")
    told_of = "the layer low looks 265 K, colder than the clear sky of 270 K behind it low in the picture"
    assert notice.message.startswith(told_of)
    assert "at 10.0 degrees" in notice.message
    assert told(265.3) == []  # the sky's own figures are good to 5 K
    assert told(200.0, camera={**camera, "elevation_deg": -20}) == []


def test_through_air_a_cloud_as_warm_as_the_air_is_warmer_than_the_sky() -> None:
    """At 4 km and 3 degrees it is 310 m high: the US standard atmosphere of 1976 has 286.1 K there (288.15 - 6.5 z)."""
    for kelvin, warned in ((286.0, False), (230.0, True)):
        sky = {"kind": "sky", "preset": "us_standard", "clouds": [{"temperature_k": kelvin, "range_m": 4000}]}
        camera = {"size": (64, 48), "elevation_deg": 3}
        assert bool(list(doubts(scene(camera=camera, background=sky, targets=[])))) == warned


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
        f"{file}:8:88: targets.jet.path.range_m: warning: a range of 30 km lies beyond the fitted 0.5 to 20 km"
    )
    (idle,) = warnings(file, ["atmosphere.preset=none"])
    assert idle.startswith(f"{file}:5:18: atmosphere.visibility_km: warning: does not count without a preset")
    check([str(file)])
    printed = capsys.readouterr()
    assert printed.out == f"{file}: ok\n"
    assert printed.err.splitlines() == [hazy, far]


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
    assert all(words in notice.message for words in ("1200 px", "1024 px", "51.2 mrad"))


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
        (notice.at, notice.message)
        for notice in doubts(scene(camera=camera, atmosphere={}, background=background, frames=10))
        if notice.at[0] == "camera"
    ]
    assert [place for place, _ in found] == ([("camera", at)] if at else [])
    assert all(words in what for _, what in found)
