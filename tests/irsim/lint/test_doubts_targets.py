"""Targets under the ground or high above it, through the camera, in turns that nothing flies, and that never meet."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from irsim.lint import doubts
from irsim.scenario.model import Scenario

CAMERA = {"size": (160, 120), "ifov_mrad": 0.3}
FLAT = {"kind": "sky", "horizon_k": 285.0, "zenith_k": 285.0}


def told(path: dict[str, Any], shape: str = "tank", **scene: Any) -> list[str]:
    """What is said of the path of the last target."""
    target = {"id": "it", "shape": {"kind": shape}, "path": path}
    whole = {"frames": 60, "camera": CAMERA, "background": FLAT, **scene}
    whole["targets"] = [*scene.get("targets", []), target]
    last = ("targets", len(whole["targets"]) - 1, "path")
    return [notice.message for notice in doubts(Scenario.model_validate(whole)) if notice.at[:3] == last]


def _stands(y: float, range_m: float) -> dict[str, Any]:
    return {"kind": "straight", "start": (80, y), "speed": 0, "range_m": range_m}


@pytest.mark.parametrize("kind", ["landscape", "sea"])
@pytest.mark.parametrize(("range_m", "said"), [(2000, True), (900, False), (660, False)])
def test_a_range_far_beyond_the_ground_in_its_pixel_is_told(kind: str, range_m: float, said: bool) -> None:
    """Row 110 lies 50.5 px below the level: that ray meets ground 10 m below at 10 / sin(atan(0.3e-3 * 50.5)) m."""
    lines = told(_stands(110, range_m), background={"kind": kind, "camera_height_m": 10})
    assert len(lines) == said
    sine = math.sin(math.atan(0.3e-3 * 50.5))
    for line in lines:
        found = re.search(r"by ([\d.]+) m at most, and is drawn before it: it is 2000 m away where .* at (\d+) m", line)
        assert found is not None
        assert float(found[1]) == pytest.approx(2000 * sine - 10, rel=5e-3)
        assert float(found[2]) == pytest.approx(10 / sine, rel=5e-3)


def test_a_target_that_is_not_there_while_it_would_be_deep_is_not_told() -> None:
    """It goes down from the horizon at 2 km, and is gone before it is deep."""
    path = {**_stands(61, 2000), "speed": 1, "heading_deg": 90}
    land = {"kind": "landscape", "camera_height_m": 10}
    assert len(told(path, background=land)) == 1
    scene = {"frames": 60, "camera": CAMERA, "background": land}
    gone = {"id": "it", "shape": {"kind": "tank"}, "path": path, "absent": [(10, 59)]}
    said = [notice.message for notice in doubts(Scenario.model_validate({**scene, "targets": [gone]}))]
    assert not any("goes below" in line for line in said)


@pytest.mark.parametrize(
    ("shape", "y", "said"),
    [("tank", 20, True), ("boat", 20, True), ("pedestrian", 20, True), ("helicopter", 20, False), ("tank", 80, False)],
)
def test_what_stands_on_the_ground_is_told_high_above_it(shape: str, y: float, said: bool) -> None:
    """Row 20 lies 39.5 px above the level: 9.5 m at 800 m, and the ground 10 m below it."""
    lines = told(_stands(y, 800), shape, background={"kind": "landscape", "camera_height_m": 10, "hills_mrad": 0.5})
    assert len(lines) == said
    assert all(f"a {shape}, is 19.5 m above the ground, 10 m under the camera" in line for line in lines)


def test_on_hills_it_may_stand_as_high_as_they_are() -> None:
    """800 m away, 5 mrad are 4 m: four times that leaves 3.5 m for a tank of 7 m."""
    hills = {"kind": "landscape", "camera_height_m": 10, "hills_mrad": 5.0}
    assert told(_stands(20, 800), background=hills) == []


@pytest.mark.parametrize(
    ("closing_m_s", "frames", "said"),
    [(900, 60, "at frame 33 it goes through the camera"), (900, 33, None), (500, 60, None), (-900, 60, None)],
)
def test_a_range_that_is_used_up_is_told(closing_m_s: float, frames: int, said: str | None) -> None:
    """1000 m at 900 m/s last for 33.3 frames."""
    lines = told({**_stands(60, 1000), "closing_m_s": closing_m_s}, "fighter", frames=frames)
    assert [line[: len(said or "")] for line in lines if "through the camera" in line] == ([said] if said else [])


@pytest.mark.parametrize(("aside_m", "said"), [(0.5, 1), (3.0, 0)])
def test_a_way_past_the_camera_is_told_where_it_is_no_way_past(aside_m: float, said: int) -> None:
    """Also where it is the camera that is carried."""
    path = {"kind": "straight_m", "start_m": (aside_m, 0, 300), "velocity_m_s": (0, 0, 0)}
    carried = {**CAMERA, "motion": [{"kind": "platform", "velocity_m_s": (0, 200, 0)}]}
    assert len([line for line in told(path, "bird", camera=carried) if "at frame 45 it goes" in line]) == said
    assert told(path, "bird") == []


@pytest.mark.parametrize(("turn_deg_s", "said"), [(400, True), (20, False)])
@pytest.mark.parametrize("rate_hz", [30.0, 100.0])
def test_a_turn_that_nothing_flies_is_told_with_its_load(turn_deg_s: float, said: bool, rate_hz: float) -> None:
    """Speed times rate of turn, over g; chords of a frame's arc make it less, by sin(x) / x squared."""
    path = {"kind": "turns_m", "start_m": (0, 0, 2000), "speed_m_s": 1000, "turns": [(0, 50, turn_deg_s)]}
    lines = told(path, "missile", camera={**CAMERA, "rate_hz": rate_hz})
    loads = [float(found[1]) for line in lines if (found := re.search(r"pulls (\d+) g", line))]
    omega = math.radians(turn_deg_s)
    half = omega / rate_hz / 2
    assert loads == pytest.approx([1000 * omega / 9.80665 * (math.sin(half) / half) ** 2] if said else [], rel=2e-3)


@pytest.mark.parametrize(
    "keys",
    [
        {"kind": "weave_m", "amplitude_m": 40, "period_s": 1},  # 40 m (2 pi / s)^2: 161 g, for 0.38 s of a half
        {"kind": "jump_m", "rates_deg_s": [300]},  # 200 m/s at 5.2 rad/s: 107 g
        {
            "kind": "manoeuvre_m",
            "keep_in_m": (-200, 1800, 200, 2200),
        },  # steers with up to 150 g
        {"kind": "stop_and_go_m", "speed_m_s": 200, "go_s": 0.6, "stop_s": 0.3, "ease_s": 0.3},  # 68 g of braking
    ],
)
def test_every_kind_of_path_in_metres_is_held_to_what_can_be_flown(keys: dict[str, Any]) -> None:
    assert any(" pulls " in line for line in told({"start_m": (0, 0, 2000), **keys}, "missile"))
    gentle = {"kind": keys["kind"], "start_m": (0, 0, 2000)}
    assert not any(" pulls " in line for line in told(gentle, "missile"))


def test_a_corner_is_no_turn() -> None:
    corner = {"kind": "waypoints_m", "points": [[-50, 0, 2000], [0, 0, 2000], [0, -50, 2000]], "speed_m_s": 60}
    assert not any("pulls" in line for line in told(corner, "quadrotor"))


@pytest.mark.parametrize(("miss_px", "said"), [(45, True), (-45, True), (1, False), (0, False)])
def test_two_that_never_meet_are_told(miss_px: float, said: bool) -> None:
    first = {"id": "a", "shape": {"kind": "point"}, "path": {"kind": "straight", "start": (30, 60), "speed": 1.5}}
    path = {"kind": "crosses", "target": "a", "at_frame": 30, "speed": 1, "miss_px": miss_px}
    lines = [line for line in told(path, "point", targets=[first]) if "never meet" in line]
    assert len(lines) == said
    assert all("it and a never meet: they stay 45 px apart; they touch at " in line for line in lines)


def test_two_large_ones_meet_at_a_distance_of_their_places() -> None:
    """Two fighters of 15 m 1000 m away are 50 px long each."""
    first = {"id": "a", "shape": {"kind": "fighter"}, "path": {"kind": "straight", "start": (30, 60), "speed": 1.5}}
    path = {"kind": "crosses", "target": "a", "at_frame": 30, "speed": 1, "miss_px": 20}
    assert told(path, "fighter", targets=[first]) == []


@pytest.mark.parametrize(
    ("keys", "apart"),
    [
        # Square to the line of sight, 15 m at 1000 m are 50 px of 0.3 mrad.
        ({"miss_m": 15, "miss_deg": 90}, 50),
        ({"miss_m": 30, "angle_deg": -90, "speed_m_s": 40}, None),  # 0.8 s later it is behind the other
        ({"miss_m": 0}, None),
    ],
)
def test_two_that_pass_far_from_each_other_in_the_picture_are_told(keys: dict[str, Any], apart: int | None) -> None:
    way = {"kind": "straight_m", "start_m": (-20, 0, 1000), "velocity_m_s": (30, 0, 0)}
    first = {"id": "a", "shape": {"kind": "point"}, "path": way}
    path = {"kind": "crosses_m", "target": "a", "at_frame": 30, "angle_deg": 180, "speed_m_s": 30, **keys}
    lines = [line for line in told(path, "point", targets=[first]) if "never meet" in line]
    assert [line.split(";")[0] for line in lines] == (
        [f"it and a never meet: they stay {apart} px apart"] if apart is not None else []
    )


def test_two_that_go_through_each_other_between_two_frames_do_meet() -> None:
    first = {"id": "a", "shape": {"kind": "point"}, "path": {"kind": "straight", "start": (30, 60), "speed": 1.5}}
    path = {"kind": "crosses", "target": "a", "at_frame": 30.5, "speed": 15}
    assert told(path, "point", targets=[first]) == []


@pytest.mark.parametrize(("down_m", "said"), [(8, False), (13, True)])
def test_a_crossing_in_metres_is_held_to_the_ground_as_other_paths_in_metres_are(down_m: float, said: bool) -> None:
    """The ground is 10 m below the camera; a range written by eye would be forgiven 5 m."""
    way = {"kind": "straight_m", "start_m": (-20, down_m, 700), "velocity_m_s": (20, 0, 0)}
    first = {"id": "a", "shape": {"kind": "tank"}, "path": way}
    path = {"kind": "crosses_m", "target": "a", "at_frame": 30, "speed_m_s": 10, "angle_deg": 45}
    lines = told(path, "tank", targets=[first], background={"kind": "landscape", "camera_height_m": 10})
    assert any("goes below the ground" in line for line in lines) == said


@pytest.mark.parametrize(
    ("motion", "shown"),
    [
        ([], None),
        # The pan of 15 px a frame to the right takes (1.5, 0) to (-13.5, 0) and (0, 1) to (-15, 1).
        ([{"kind": "pan", "azimuth_deg_s": math.degrees(15 * 0.3e-3 * 25)}], -4),
        ([{"kind": "shake", "rms_px": 0.3}], None),
    ],
)
def test_a_crossing_whose_angle_the_camera_s_motion_changes_is_told(
    motion: list[dict[str, Any]], shown: int | None
) -> None:
    camera = {**CAMERA, "rate_hz": 25, "motion": motion}
    first = {"id": "a", "shape": {"kind": "point"}, "path": {"kind": "straight", "start": (80, 60), "speed": 1.5}}
    path = {"kind": "crosses", "target": "a", "at_frame": 2, "speed": 1}
    lines = [line for line in told(path, "point", targets=[first], camera=camera) if "cross at" in line]
    assert [line.split(":")[0] for line in lines] == (
        [f"in the picture it and a cross at {shown} degrees, and for a camera that stands still at 90"]
        if shown is not None
        else []
    )


@pytest.mark.parametrize(
    ("shape", "ground_m", "said"),
    [
        *[("tank", 10, False), ("tank", 10.9, False), ("tank", 11.1, True), ("tank", 600, True), ("tank", 5, True)],
        *[("point", 8.8, True), ("point", 9.1, False), ("boat", 7, False)],
    ],
)
@pytest.mark.parametrize("kind", ["landscape", "sea"])
def test_a_ground_of_its_own_unlike_the_backgrounds_is_told(kind: str, shape: str, ground_m: float, said: bool) -> None:
    """A metre is a tenth of 10 m; the middle of what is long may be higher up."""
    path = {"kind": "straight", "start": (80, 110), "speed": 0, "ground_m": ground_m}
    background = {"kind": kind, "camera_height_m": 10, **({"hills_mrad": 0} if kind == "landscape" else {})}
    scene = {"frames": 9, "camera": CAMERA, "background": background}
    target = {"id": "it", "shape": {"kind": shape, **({"area_m2": 2} if shape == "point" else {})}, "path": path}
    notices = [*doubts(Scenario.model_validate({**scene, "targets": [target]}))]
    found = [notice.message for notice in notices if notice.at == ("targets", 0, "path", "ground_m")]
    assert len(found) == said
    assert not any("goes below" in each.message or "m above the" in each.message for each in notices)
    for what in found:
        surface = "sea" if kind == "sea" else "ground"
        side = "farther" if ground_m > 10 else "nearer"
        assert what.startswith(f"the background has its {surface} 10 m below the camera, it goes {ground_m:g} m below")
        assert f"is {side} than the {surface}" in what


def test_a_ground_of_its_own_is_all_there_is_where_the_background_has_none() -> None:
    path = {"kind": "straight", "start": (80, 110), "speed": 0, "ground_m": 40}
    assert told(path, background={"kind": "ground"}) == []


@pytest.mark.parametrize(("range_m", "said"), [(12000, False), (15900, False), (16300, True), (50000, True)])
def test_what_a_round_earth_would_hide_is_told(range_m: float, said: bool) -> None:
    """From 9 m the horizon is 3.86 * 3 = 11.6 km away, and 4.5 km from 1.35 m, where a boat's middle is taken to be."""
    up = {"kind": "straight_m", "start_m": (0, 9 - 1.35, range_m), "velocity_m_s": (0, 0, 0)}
    lines = [
        line for line in told(up, "boat", background={"kind": "sea", "camera_height_m": 9}) if "round earth" in line
    ]
    assert len(lines) == said
    for line in lines:
        found = re.search(r"what is 1.35 m up beyond ([\d.]+) km from a camera 9 m up; the sea is flat", line)
        assert found is not None
        assert float(found[1]) == pytest.approx(3.86 * (3 + math.sqrt(1.35)), rel=5e-3)


def test_the_sky_and_ground_of_no_depth_know_no_horizon() -> None:
    far = {"kind": "straight_m", "start_m": (0, 8, 80000), "velocity_m_s": (0, 0, 0)}
    assert not any("round earth" in line for line in told(far, "boat"))
    assert not any("round earth" in line for line in told(far, "boat", background={"kind": "ground"}))
