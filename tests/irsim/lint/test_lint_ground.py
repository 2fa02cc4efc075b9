"""Warnings about the ground or sea, and about targets below or above it."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest
from lint_scenes import check_warning, warned

CAMERA = {"size": (160, 120), "ifov_mrad": 0.3}


def path_warnings(path: dict[str, Any], shape: str = "tank", **scene: Any) -> dict[str, str]:
    """Return the warnings of the path of one target in 160 x 120 px of 0.3 mrad."""
    target = {"id": "it", "shape": {"kind": shape}, "path": path}
    found = warned({"frames": 60, "camera": CAMERA, "targets": [target], **scene})
    return {place: message for place, message in found.items() if place.startswith("targets.0.path")}


def at_rest(y: float, **range_m: float) -> dict[str, Any]:
    return {"kind": "straight", "start": (80, y), "speed": 0, **range_m}


@pytest.mark.parametrize(
    ("kind", "elevation_deg", "above"),
    [("ground", 30, True), ("ground", 0, False), ("landscape", 30, False)],
)
def test_ground_above_horizon(kind: str, elevation_deg: float, above: bool) -> None:
    scene = {"camera": {"elevation_deg": elevation_deg, "ifov_mrad": 0.5}, "background": {"kind": kind}}
    lowest = 30 - math.degrees(math.atan(23.5 * 0.5e-3))
    check_warning(scene, "background" if above else None, f"begins {lowest:.1f} degrees above the horizon")


def test_ground_above_horizon_after_a_turn() -> None:
    """The camera rises by a degree a frame; half of the picture is 0.7 degrees."""
    camera = {"elevation_deg": 0.0, "motion": [{"kind": "pan", "elevation_deg_s": 30.0}]}
    check_warning(
        {"camera": camera, "background": {"kind": "ground"}}, "background", "at frame 30 the picture begins 29.3"
    )


@pytest.mark.parametrize(
    ("elevation_deg", "place", "words"),
    [
        (4.0, "background", "begins 3.3 degrees above the horizon"),
        (0.0, "background.height_m", "0.7 degrees above the horizon; higher than 2.9 below it"),
        (-3.0, "background.height_m", "2.3 degrees below the horizon"),
        (-4.0, None, ""),
    ],
)
def test_ground_near_horizon(elevation_deg: float, place: str | None, words: str) -> None:
    """Half of the picture is 0.67 degrees; the plane ends 2.87 degrees below the level."""
    camera = {"elevation_deg": elevation_deg, "ifov_mrad": 0.5}
    check_warning({"camera": camera, "background": {"kind": "ground", "height_m": 50}}, place, words)


@pytest.mark.parametrize(
    ("background", "speed_m_s", "fixed"),
    [
        ({"kind": "ground"}, 12, True),
        ({"kind": "ground", "height_m": 100}, 12, False),
        ({"kind": "landscape"}, 12, False),
        ({"kind": "ground"}, 0, False),
    ],
)
def test_ground_without_parallax(background: dict[str, Any], speed_m_s: float, fixed: bool) -> None:
    """12 m in 31 frames are 24 px at 1000 m and 0.5 mrad."""
    camera = {"motion": [{"kind": "platform", "velocity_m_s": (speed_m_s, 0.0, 0.0)}]}
    car = {"id": "car", "shape": {"kind": "point", "area_m2": 3}}
    car["path"] = {"kind": "straight", "start": (40, 40), "range_m": 1000}
    found = warned({"camera": camera, "background": background, "targets": [car]})
    messages = {place: message for place, message in found.items() if "the camera moves by 12 m" in message}
    assert list(messages) == ["background"] * fixed
    assert all("car slides over it by 24 px" in message for message in messages.values())


@pytest.mark.parametrize("kind", ["landscape", "sea"])
@pytest.mark.parametrize(("range_m", "below"), [(2000, True), (900, False)])
def test_target_below_ground(kind: str, range_m: float, below: bool) -> None:
    """Row 110 lies 50.5 px below the level: that ray meets ground 10 m below at 10 / sin(atan(0.3e-3 * 50.5)) m."""
    found = path_warnings(at_rest(110, range_m=range_m), background={"kind": kind, "camera_height_m": 10})
    assert list(found) == ["targets.0.path"] * below
    sine = math.sin(math.atan(0.3e-3 * 50.5))
    for message in found.values():
        match = re.search(r"by ([\d.]+) m at most, .* in front of it: it is at 2000 m where .* at (\d+) m", message)
        assert match is not None
        assert [float(each) for each in match.groups()] == pytest.approx([2000 * sine - 10, 10 / sine], rel=5e-3)


@pytest.mark.parametrize(("down_m", "below"), [(8, False), (13, True)])
def test_crossing_in_metres_below_ground(down_m: float, below: bool) -> None:
    """Ground is 10 m below; the tolerance of 5 m of a path in pixels does not apply."""
    path = {"kind": "straight_m", "start_m": (-20, down_m, 700), "velocity_m_s": (20, 0, 0)}
    found = path_warnings(path, background={"kind": "landscape", "camera_height_m": 10})
    assert any("goes below the ground" in message for message in found.values()) == below


@pytest.mark.parametrize(
    ("shape", "y", "hills_mrad", "above"),
    [
        *[("tank", 20, 0.5, True), ("helicopter", 20, 0.5, False)],
        *[("tank", 80, 0.5, False), ("tank", 20, 5, False)],
    ],
)
def test_target_above_ground(shape: str, y: float, hills_mrad: float, above: bool) -> None:
    """Row 20 lies 39.5 px above the level: 9.5 m at 800 m, and the ground 10 m below. Hills of 5 mrad reach 16 m."""
    land = {"kind": "landscape", "camera_height_m": 10, "hills_mrad": hills_mrad}
    found = path_warnings(at_rest(y, range_m=800), shape, background=land)
    assert list(found) == ["targets.0.path"] * above
    assert all(f"a {shape}, is 19.5 m above the ground, 10 m under" in message for message in found.values())


@pytest.mark.parametrize(
    ("kind", "shape", "ground_m", "off"),
    [
        *[("landscape", "tank", 10.9, False), ("landscape", "tank", 11.1, True), ("sea", "tank", 5, True)],
        *[("sea", "boat", 7, False), ("ground", "tank", 40, False)],
    ],
)
def test_target_off_ground_level(kind: str, shape: str, ground_m: float, off: bool) -> None:
    """A tenth of 10 m is a metre; the center of a long target may be higher up."""
    background = {"kind": kind, **({"camera_height_m": 10} if kind != "ground" else {})}
    background |= {"hills_mrad": 0} if kind == "landscape" else {}
    found = path_warnings(at_rest(110, ground_m=ground_m), shape, background=background)
    assert list(found) == ["targets.0.path.ground_m"] * off
    side = "farther" if ground_m > 10 else "nearer"
    assert all(
        f"10 m below the camera, but it moves {ground_m:g} m below it and is {side}" in m for m in found.values()
    )


@pytest.mark.parametrize(("range_m", "beyond"), [(15900, False), (16300, True)])
def test_target_beyond_horizon(range_m: float, beyond: bool) -> None:
    """From 9 m the horizon is 3.86 * 3 = 11.6 km away, and 4.5 km from 1.35 m, the center of a boat."""
    path = {"kind": "straight_m", "start_m": (0, 9 - 1.35, range_m), "velocity_m_s": (0, 0, 0)}
    found = path_warnings(path, "boat", background={"kind": "sea", "camera_height_m": 9})
    assert any("round earth" in message for message in found.values()) == beyond
    for message in found.values() if beyond else ():
        match = re.search(r"from a camera 9 m up a round earth hides a target 1.35 m up beyond ([\d.]+) km", message)
        assert match is not None
        assert float(match[1]) == pytest.approx(3.86 * (3 + math.sqrt(1.35)), rel=5e-3)
