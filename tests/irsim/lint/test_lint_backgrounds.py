"""Warnings about skies, clouds, clutter and layers that the camera passes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lint_scenes import check_warning, warned

SKY = {"kind": "sky", "horizon_k": 290, "zenith_k": 245}
EAST = {"motion": [{"kind": "platform", "velocity_m_s": (12.0, 0.0, 0.0)}]}
"""12 m in 31 frames."""


@pytest.mark.parametrize(
    ("sky", "inverted"),
    [({"horizon_k": 250, "zenith_k": 285}, True), ({"horizon_k": 280, "zenith_k": 280}, False), (SKY, False)],
)
def test_sky_warmest_at_zenith(sky: dict[str, Any], inverted: bool) -> None:
    check_warning({"background": {"kind": "sky", **sky}}, "background.zenith_k" if inverted else None, "is warmer than")


def test_cloud_colder_than_sky() -> None:
    """The picture begins at 10 degrees, where the sky is 245 + 45 exp(-sin 10 / 0.3) = 270.2 K, good to 5 K."""
    for kelvin, place in ((265.1, "background.clouds.0.temperature_k"), (265.3, None)):
        camera = {"ifov_mrad": 1.0, "elevation_deg": 10 + np.degrees(np.arctan(0.024))}
        background = {**SKY, "clouds": [{"id": "low", "temperature_k": kelvin}]}
        words = "the layer low looks 265 K, colder than the clear sky of 270 K behind it low in the picture"
        check_warning({"camera": camera, "background": background}, place, words)


def test_cloud_as_warm_as_the_air_is_warmer_than_sky() -> None:
    """At 4 km and 3 degrees it is 310 m up: the US standard atmosphere has 286.1 K there (288.15 - 6.5 z)."""
    for kelvin, cold in ((286.0, False), (230.0, True)):
        sky = {"kind": "sky", "preset": "us_standard", "clouds": [{"temperature_k": kelvin, "range_m": 4000}]}
        air = {"preset": "us_standard"}
        assert bool(warned({"camera": {"elevation_deg": 3}, "background": sky, "atmosphere": air})) == cold


@pytest.mark.parametrize(("ifov_mrad", "place"), [(0.06, None), (0.05, "background.clouds.0.correlation_mrad")])
def test_cloud_features_wider_than_texture(ifov_mrad: float, place: str | None) -> None:
    """60 mrad are 1,000 px at 0.06 mrad and 1,200 at 0.05; the texture repeats after 1,024."""
    clouds = [{"id": "a", "temperature_k": 290, "correlation_mrad": 60}]
    camera = {"ifov_mrad": ifov_mrad, "elevation_deg": 10}
    words = "would be 1200 px wide, but its texture repeats after 1024 px: try 51.2 mrad at most"
    check_warning({"camera": camera, "background": {**SKY, "clouds": clouds}}, place, words)


@pytest.mark.parametrize(
    ("elevation_deg", "columns", "rise_deg_s", "place", "words"),
    [
        (73, 64, 0, None, ""),
        (-74.8, 64, 0, "camera.elevation_deg", "frame 0: the picture comes within 14 degrees of the zenith"),
        (0, 1100, 0, None, ""),
        (0, 1200, 0, "camera.ifov_mrad", "the picture is 62 degrees wide: beyond 60"),
        (70, 64, 6, "camera.elevation_deg", "frame 30: the picture comes within"),
    ],
)
def test_distorted_projection(
    elevation_deg: float, columns: int, rise_deg_s: float, place: str | None, words: str
) -> None:
    """Half a height of 24 px of 1 mrad is 1.4 degrees: 75 degrees are reached from 73.6 on."""
    motion = [{"kind": "pan", "elevation_deg_s": rise_deg_s}]
    camera = {"size": (columns, 48), "ifov_mrad": 1.0, "elevation_deg": elevation_deg, "motion": motion}
    check_warning({"camera": {**camera, "rate_hz": 30}, "background": SKY}, place, words)


HIDDEN = "of them lie over each point on average and hide the ground"


@pytest.mark.parametrize(
    ("kind", "clutter", "ifov_mrad", "message"),
    [
        ("ground", {"per_mrad2": 0.6}, 0.4, None),
        ("ground", {"per_mrad2": 1}, 0.4, f"4.1 {HIDDEN}; try 0.73 at most"),
        ("ground", {"per_mrad2": 0.01}, 20, "there are 4200000 of them, which take long to draw; try 0.0012 at most"),
        ("landscape", {"per_mrad2": 0.01}, 20, None),
        ("landscape", {"per_mrad2": 10}, 0.4, f"41 {HIDDEN}; try 0.73 at most"),
    ],
)
def test_dense_clutter(kind: str, clutter: dict[str, Any], ifov_mrad: float, message: str | None) -> None:
    """The texture of a ground is 1024 px wide and high; a landscape has far fewer objects."""
    camera = {"ifov_mrad": ifov_mrad, "elevation_deg": -5.0}
    found = warned({"camera": camera, "background": {"kind": kind, "clutter": clutter}})
    assert found.get("background.clutter.per_mrad2") == message


def test_clouds_passed_by_camera() -> None:
    """At 0.4 m a frame it has moved 10.4 m at frame 26, and half of 13 m at frame 17."""
    clouds = [{"id": "far", "range_m": 13}, {"id": "near", "range_m": 10.2}, {"id": "farther", "range_m": 24.1}]
    found = warned({"camera": EAST, "background": {**SKY, "clouds": clouds}})
    assert {place: message for place, message in found.items() if "has moved" in message} == {
        "background.clouds.0.range_m": "at frame 17 the camera has moved by 6.5 m: the texture of far, drawn for the "
        "first position, becomes stretched or coarse",
        "background.clouds.1.range_m": "at frame 26 the camera has moved by 10.2 m: it has passed near, which is no "
        "longer drawn",
    }


@pytest.mark.parametrize(("velocity", "passed"), [((0.0, 12.0, 0.0), True), ((0.0, 0.0, -12.0), False)])
def test_trees_passed_by_camera(velocity: tuple[float, float, float], passed: bool) -> None:
    """12 m north leave a row 10.2 m away; as far down, the row is still all around."""
    camera = {"motion": [{"kind": "platform", "velocity_m_s": velocity}], "elevation_deg": -60.0}
    background = {"kind": "landscape", "camera_height_m": 40.0, "trees": [{"id": "row", "range_m": 10.2}]}
    assert ("background.trees.0.range_m" in warned({"camera": camera, "background": background})) == passed
