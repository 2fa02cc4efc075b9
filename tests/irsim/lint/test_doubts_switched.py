"""What is switched off raises no doubt: warnings are of the scene that is shown."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import pytest

from irsim.lint import doubts
from irsim.lint.registry import DOUBTS
from irsim.scenario.model import Scenario
from irsim.scenario.placement_all import overdone


def _scene(motion: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """A point that stands 2 km away, and a camera of 80 x 60 px and 0.5 mrad with one motion, named `culprit`."""
    camera = {"size": (80, 60), "motion": [{"id": "culprit", **motion}], **changes.pop("camera", {})}
    path = {"kind": "straight", "start": (40, 30), "range_m": 2000, **changes.pop("path", {})}
    target = {"id": "jet", "shape": {"kind": "point"}, "path": path, **changes.pop("target", {})}
    ground = {"kind": "ground", "spread_k": 0}
    return {"frames": 61, "camera": camera, "background": ground, "targets": [target], **changes}


PAN = {"kind": "pan", "azimuth_deg_s": 30.0}  # 35 px a frame
BAR = {"kind": "bar", "range_m": 500}
AIR = {"preset": "us_standard"}
SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "folded": ("of the zenith", _scene({"kind": "pan", "elevation_deg_s": 45.0})),
    "beads": ("px from step to step", _scene(PAN, camera={"smear": {"time_ms": 20.0, "steps": 2}})),
    "hardly_seen": ("never in the picture", _scene(PAN, target={"absent": [(0, 10)]}, frames=30)),
    "idle": (
        "it hides no target",
        # The camera has gone 10 m aside before the target is there: the bar, 500 m away, stands 30 px aside of it.
        _scene(
            {"kind": "platform", "velocity_m_s": (30.0, 0.0, 0.0)},
            target={"absent": [(0, 9)]},
            occluders=[{**BAR, "center_px": (40, 30), "size_px": (9, 9)}],
        ),
    ),
    "sunken": (
        "has come down to the ground",
        _scene(
            {"kind": "platform", "velocity_m_s": (0.0, 0.0, -10.0)},
            background={"kind": "landscape", "camera_height_m": 10.0},
        ),
    ),
    "stays_behind": (
        "the ground does not pass by",
        _scene({"kind": "platform", "velocity_m_s": (30.0, 0.0, 0.0)}),
    ),
    "left_behind": (
        "it has gone through clouds",
        _scene(
            {"kind": "platform", "velocity_m_s": (0.0, 30.0, 0.0)},
            background={"kind": "sky", "clouds": [{"range_m": 50.0}]},
        ),
    ),
    "ground_to_the_horizon": (
        "the ground is drawn as if it rose",
        _scene(
            {"kind": "pan", "elevation_deg_s": 5.0},
            camera={"elevation_deg": -12.0},
            background={"kind": "ground", "spread_k": 0, "height_m": 30.0},
        ),
    ),
    "long_paths": (
        "frame 60: ",
        _scene({"kind": "platform", "velocity_m_s": (0.0, -60_000.0, 0.0)}, atmosphere=AIR),
    ),
    "overdone": (
        "of them where 3 are asked",
        # From a camera that goes a third as far the other way, less a little, the point hardly leaves the bar.
        _scene(
            {"kind": "platform", "velocity_m_s": (-9.0, 0.0, 0.0)},
            path={"start": (10, 30), "speed": 1.0},
            occluders=[{**BAR, "hides": "jet", "frames": (30, 32)}],
        ),
    ),
}


def _told(scene: dict[str, Any]) -> list[str]:
    return [notice.message for notice in doubts(Scenario.model_validate(scene))]


@pytest.mark.parametrize("name", SCENES)
def test_switching_the_culprit_off_silences_the_doubt(name: str) -> None:
    said, scene = SCENES[name]
    assert name in [doubt.__name__ for doubt in DOUBTS]
    assert any(said in text for text in _told(scene))
    assert not any(said in text for text in _told({**scene, "without": ["culprit"]}))


@pytest.mark.parametrize("name", SCENES)
def test_a_motion_that_is_off_is_doubted_as_one_that_is_not_there(name: str) -> None:
    """Of each doubt; but for occluders that are placed by whom they hide, which stay where they are."""
    _, scene = SCENES[name]
    less = deepcopy(scene)
    less["camera"]["motion"] = []
    off = Scenario.model_validate({**scene, "without": ["culprit"]})
    for doubt in DOUBTS:
        if doubt is not overdone:
            assert list(doubt(off)) == list(doubt(Scenario.model_validate(less))), doubt.__name__


def test_a_target_that_is_off_leaves_no_beads_and_needs_no_occluder() -> None:
    scene = _scene({"kind": "pan"}, path={"speed": 30.0}, camera={"smear": {"time_ms": 20.0, "steps": 2}})
    scene["occluders"] = [{**BAR, "center_px": (5, 5), "size_px": (3, 3)}]
    assert any("jet moves by" in text for text in _told(scene))
    assert "it hides no target in any frame" in _told(scene)
    assert _told({**scene, "without": ["jet"]}) == []
