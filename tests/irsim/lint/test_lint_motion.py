"""Warnings about the motion of camera and targets."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest
from lint_scenes import check_warning, point, warned

from irsim.lint.motion import speed_implausible
from irsim.scenario.model import Scenario
from irsim.targets import SHAPES, Shape
from irsim.targets.body import Body

CAMERA = {"size": (160, 120), "ifov_mrad": 0.3}
LEADER = {"id": "a", "shape": {"kind": "point"}, "path": {"kind": "straight", "start": (30, 60), "speed": 1.5}}


def path_warnings(path: dict[str, Any], shape: str = "tank", **scene: Any) -> str:
    """Return the warnings of the path of the last target in 160 x 120 px of 0.3 mrad."""
    target = {"id": "it", "shape": {"kind": shape}, "path": path}
    targets = [*scene.pop("targets", []), target]
    found = warned({"frames": 60, "camera": CAMERA, "targets": targets, **scene})
    return "\n".join(found[place] for place in found if place.startswith(f"targets.{len(targets) - 1}.path"))


@pytest.mark.parametrize(("off", "place"), [([], None), (["it"], "camera.motion.0.target"), (["it", "tracks"], None)])
def test_camera_follows_disabled_target(off: list[str], place: str | None) -> None:
    scene = {"camera": {"motion": [{"kind": "tracks", "target": "it"}]}, "targets": [point()], "without": off}
    check_warning(scene, place, "it is switched off, but the camera still follows it")


@pytest.mark.parametrize(("speed_m_s", "below"), [(-10.0, True), (-5.0, False)])
def test_camera_below_ground(speed_m_s: float, below: bool) -> None:
    camera = {"motion": [{"kind": "pan"}, {"kind": "platform", "velocity_m_s": (0.0, 0.0, speed_m_s)}]}
    scene = {"frames": 61, "camera": camera, "background": {"kind": "landscape", "camera_height_m": 12.0}}
    check_warning(scene, "camera.motion.1" if below else None, "at frame 36 the camera reaches the ground, 12 m below")


@pytest.mark.parametrize(("closing_m_s", "frames", "through"), [(900, 60, True), (900, 33, False), (-900, 60, False)])
def test_target_through_camera(closing_m_s: float, frames: int, through: bool) -> None:
    """1000 m at 900 m/s last for 33.3 frames."""
    path = {"kind": "straight", "start": (80, 60), "range_m": 1000, "closing_m_s": closing_m_s}
    found = path_warnings(path, "missile", frames=frames)
    assert ("at frame 33 it passes through the camera" in found) == through


@pytest.mark.parametrize(("aside_m", "through"), [(0.5, True), (3.0, False)])
def test_camera_through_target(aside_m: float, through: bool) -> None:
    path = {"kind": "straight_m", "start_m": (aside_m, 0, 300), "velocity_m_s": (0, 0, 0)}
    moving = {**CAMERA, "motion": [{"kind": "platform", "velocity_m_s": (0, 200, 0)}]}
    assert ("at frame 45 it passes through" in path_warnings(path, "bird", camera=moving)) == through
    assert path_warnings(path, "bird") == ""


@pytest.mark.parametrize(("turn_deg_s", "rate_hz", "pulls"), [(400, 30.0, True), (400, 100.0, True), (20, 30.0, False)])
def test_implausible_acceleration(turn_deg_s: float, rate_hz: float, pulls: bool) -> None:
    """Speed times rate of turn, over g; chords of a frame's arc reduce it by (sin x / x) squared."""
    path = {"kind": "turns_m", "start_m": (0, 0, 2000), "speed_m_s": 1000, "turns": [(0, 50, turn_deg_s)]}
    found = path_warnings(path, "missile", camera={**CAMERA, "rate_hz": rate_hz})
    loads = [float(load) for load in re.findall(r"pulls (\d+) g", found)]
    omega = math.radians(turn_deg_s)
    half = omega / rate_hz / 2
    assert loads == pytest.approx([1000 * omega / 9.80665 * (math.sin(half) / half) ** 2] if pulls else [], rel=2e-3)


@pytest.mark.parametrize(("word", "kind"), list(SHAPES))
def test_speed_limit_of_each_body(word: str, kind: type[Shape]) -> None:
    fastest = kind.max_speed_m_s
    assert (fastest is not None) == issubclass(kind, Body)
    if fastest is None or "file" in kind.model_fields:
        return
    for ratio in (0.99, 1.01):
        path = {"kind": "straight_m", "start_m": (-50, 0, 4000), "velocity_m_s": (ratio * fastest, 0, 0)}
        target = {"id": "it", "shape": {"kind": word}, "path": path}
        scene = {"frames": 9, "camera": CAMERA, "background": {"kind": "sky"}, "targets": [target]}
        found = [notice.message for notice in speed_implausible(Scenario.model_validate(scene))]
        assert len(found) == (ratio > 1)
        assert all(f"and more than {fastest:g} is implausible" in message for message in found)


@pytest.mark.parametrize(("range_m", "fast"), [(6000, True), (2500, False)])
def test_speed_of_a_path_in_pixels(range_m: float, fast: bool) -> None:
    """5 px a frame of 0.5 mrad and 30 frames a second are 75 mrad/s: 450 m/s at 6 km, 188 at 2.5; the record is 133."""
    path = {"kind": "straight", "start": (10, 60), "speed": 5, "range_m": range_m}
    found = path_warnings(path, "quadrotor", frames=20, camera={"size": (160, 120), "ifov_mrad": 0.5})
    match = re.search(r"up to ([\d.]+) m/s, .* nearer to the camera$", found)
    assert (match is not None) == fast
    assert match is None or float(match[1]) == pytest.approx(2 * 30 * range_m * math.sin(5 * 0.5e-3 / 2), rel=2e-3)


@pytest.mark.parametrize(
    ("shape", "keys", "px"),
    [
        ("point", {"at_frame": 30, "speed": 1, "miss_px": -45}, 45),
        ("point", {"at_frame": 30, "speed": 1, "miss_px": 1}, None),
        ("fighter", {"at_frame": 30, "speed": 1, "miss_px": 20}, None),  # 15 m at 1000 m are 50 px
        ("point", {"at_frame": 30.5, "speed": 15}, None),  # they meet between two frames
    ],
)
def test_crossing_without_contact(shape: str, keys: dict[str, Any], px: int | None) -> None:
    leader = {**LEADER, "shape": {"kind": shape}}
    found = path_warnings({"kind": "crosses", "target": "a", **keys}, shape, targets=[leader])
    assert (found == "") if px is None else (f"it and a never meet: their least distance is {px} px; they" in found)


@pytest.mark.parametrize(
    ("keys", "px"),
    [
        ({"miss_m": 15, "miss_deg": 90}, 50),  # square to the line of sight, 15 m at 1000 m are 50 px
        ({"miss_m": 30, "angle_deg": -90, "speed_m_s": 40}, None),  # 0.8 s later it is behind the other
    ],
)
def test_crossing_in_metres_without_contact(keys: dict[str, Any], px: int | None) -> None:
    path = {"kind": "straight_m", "start_m": (-20, 0, 1000), "velocity_m_s": (30, 0, 0)}
    crosses = {"kind": "crosses_m", "target": "a", "at_frame": 30, "angle_deg": 180, "speed_m_s": 30, **keys}
    found = path_warnings(crosses, "point", targets=[{**LEADER, "path": path}])
    assert ("never meet" in found) == (px is not None)
    assert px is None or f"their least distance is {px} px" in found
