"""Warnings about targets, about occluders at a place, and about a target to follow that is hidden."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lint_scenes import check_warning, warned

from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario


@pytest.mark.parametrize(
    ("kind", "key", "hz", "frames", "still"),
    [
        ("quadrotor", "rotor_hz", 90.0, 31, True),
        ("quadrotor", "rotor_hz", 45.0, 31, True),  # half turns look the same
        ("quadrotor", "rotor_hz", 87.0, 31, False),
        ("quadrotor", "rotor_hz", 0.0, 31, False),  # still on purpose
        ("quadrotor", "rotor_hz", 87.0, 2, False),
        ("helicopter", "rotor_hz", 7.5, 31, True),
        ("bird", "beat_hz", 3.0, 31, False),
    ],
)
def test_aliased_rotation(kind: str, key: str, hz: float, frames: int, still: bool) -> None:
    path = {"kind": "straight", "start": (30, 20), "speed": 0, "heading_deg": 20, "range_m": 200}
    target = {"id": "it", "shape": {"kind": kind, key: hz}, "path": path}
    scene = {"frames": frames, "camera": {"rate_hz": 30}, "targets": [target]}
    assert (f"targets.0.shape.{key}" in warned(scene)) == still
    if frames > 2 and hz > 0:
        renderer = Renderer(Scenario.model_validate({**scene, "background": {"kind": "sky"}}))
        first, *others = (renderer.drawn_targets(index)[0].piece.sprite.alpha for index in (0, 1, 2, 7))
        same = all(first.shape == other.shape and np.allclose(first, other, atol=1e-9) for other in others)
        assert same == still


def follow(speed: float = 1.0, **target: Any) -> dict[str, Any]:
    path = {"kind": "straight", "start": (59.6, 62), "speed": speed, "range_m": 300}
    jet = {"id": "jet", "shape": {"kind": "point", "area_m2": 3}, "path": path, **target}
    return {"frames": 100, "camera": {"size": (160, 120)}, "background": {"kind": "ground"}, "targets": [jet]}


@pytest.mark.parametrize(("speed", "outside"), [(2.0, 50), (2.1, 52), (1e4, 99)])
def test_target_to_follow_outside_the_picture(speed: float, outside: int) -> None:
    """From 59.6 px it has 99.9 px to the right edge, at 159.5."""
    words = f"jet, the target to follow, is outside the picture in {outside} of the 100 frames in which it exists"
    check_warning(follow(speed), "targets.0.path" if outside > 50 else None, words)


@pytest.mark.parametrize(
    ("target", "place", "words"),
    [
        ({"path": {"kind": "straight", "start": (-300, 50)}}, "targets.0.path", "is never in the picture"),
        ({"path": {"kind": "straight", "start": (40, 40)}, "absent": [(0, 60)]}, None, ""),
        ({"absent": [(60, 120)]}, "targets.0.absent.0", "it lasts until frame 120, after the last, 99"),
        ({"absent": [(3, 9), (100, 120)]}, "targets.0.absent.1", "it begins at frame 100, after the last, 99"),
        ({"path": {"kind": "thrown", "target": "other", "at_frame": 200}}, "targets.0.path", "exists in no frame"),
    ],
)
def test_target_existence(target: dict[str, Any], place: str | None, words: str) -> None:
    scene = follow(**target)
    if "thrown" in str(target):
        path = {"kind": "straight", "start": (80, 60), "range_m": 3000}
        scene["targets"].append({"id": "other", "shape": {"kind": "fighter"}, "path": path})
    found = warned(scene)
    assert [place for place in found if place.startswith("targets.0")] == ([] if place is None else [place])
    assert all(words in found[each] for each in found if each == place)


def test_target_absent_in_all_frames() -> None:
    found = warned(follow(absent=[(0, 50), (51, 99)]))
    assert found["targets.0.absent"] == "jet exists in no frame"
    assert "never in the picture" in found["targets.0.path"]


@pytest.mark.parametrize(
    ("camera", "place"),
    [
        ({"correction": {"frames": [30, 180]}}, "camera.correction.frames.1"),
        ({"faults": [{"kind": "drop", "frames": [180]}]}, "camera.faults.0.frames.0"),
    ],
)
def test_camera_event_after_last_frame(camera: dict[str, Any], place: str) -> None:
    check_warning({"frames": 70, "camera": camera}, place, "it begins at frame 180, after the last, 69")


def test_occluder_without_effect() -> None:
    for center, place in (((60, 10), "occluders.0"), ((60, 62), None)):
        bar = {"kind": "bar", "range_m": 200, "center_px": center, "size_px": (20, 5)}
        check_warning({**follow(0.1), "occluders": [bar]}, place, "it hides no target in any frame")


def bar(wide: float, range_m: float = 100, middle: float | None = None) -> dict[str, Any]:
    center = (40 + wide / 2 if middle is None else middle, 62)
    return {"kind": "bar", "range_m": range_m, "center_px": center, "size_px": (wide, 40)}


ROW = {"buildings": [{"range_m": 200, "spacing_m": 10, "width_m": (30, 31)}]}
WALL = {"kind": "bar", "id": "wall", "range_m": 100, "hides": "tank"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"occluders": [bar(48)]}, None),
        ({"occluders": [bar(56)]}, "tank, the target to follow, is more than half hidden by bar in 13 of the 24"),
        ({"occluders": [bar(150, range_m=400, middle=80)]}, None),
        ({"occluders": [bar(10, middle=20)]}, None),
        ({"occluders": [bar(10, middle=20)], "follow": "other"}, "other, the target to follow, is more than half"),
        ({"occluders": [{**WALL, "frames": (0, 60)}]}, None),
        ({"occluders": [{**WALL, "frames": (0, 99)}]}, "hidden by wall in 24 of the 24 frames"),
        ({"background": ROW}, "hidden by buildings in 24 of the 24 frames"),
        ({"background": ROW, "without": ["buildings"]}, None),
    ],
)
def test_target_to_follow_mostly_hidden(changes: dict[str, Any], words: str | None) -> None:
    """The tank moves from 30 to 129 px and the bar begins at 40: of 24 frames, 4.3 px apart, 11 or 13 are hidden."""
    path = {"kind": "straight", "start": (30, 62), "speed": 1, "range_m": 300}
    tank = {"id": "tank", "shape": {"kind": "point"}, "path": path}
    other = {**tank, "id": "other", "path": {**path, "start": (20, 62), "speed": 0}}
    background = {"kind": "landscape", "camera_height_m": 4, **changes.get("background", {})}
    camera = {"size": (160, 120), "elevation_deg": 0}
    found = warned({"frames": 100, "camera": camera, "targets": [tank, other], **changes, "background": background})
    messages = [message for message in found.values() if "is more than half hidden" in message]
    assert len(messages) == (words is not None)
    assert all((words or "") in message for message in messages)
