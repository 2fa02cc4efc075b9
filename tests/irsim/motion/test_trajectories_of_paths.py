"""Contract of every kind of path: frames, ends, feasible keys, and the same path in pixels and in metres."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_stage import RATE, context, path, world
from pydantic import TypeAdapter, ValidationError

from irsim.lint import lint
from irsim.motion import PATHS, Path
from irsim.motion.attitude import POSTURES, STANDARD_GRAVITY, attitudes
from irsim.motion.camera_motion import Platform
from irsim.render.frame import Renderer
from irsim.scenario.loader import loads

START = [-100, 0, 2000]
EXAMPLES: dict[str, dict[str, Any]] = {
    "straight": {"start": [10, 20], "speed": 2.0, "heading_deg": 30.0, "closing_m_s": 50.0},
    "waypoints": {"points": [[10, 20], [60, 80], [140, 30]], "speed": 1.5},
    "weave": {"start": [10, 60], "speed": 1.0, "amplitude_px": 12.0},
    "manoeuvre": {"start": [80, 60], "speed": 2.0},
    "turns": {"start": [10, 60], "turns": [[10, 30, 3.0], [40, 60, -2.0]]},
    "dive_px": {"start": [10, 20], "at_frame": 10.0, "pull_out_frame": 40.0},
    "singer": {"start": [20, 40]},
    "jump": {"start": [80, 60], "hold_frames": 10.0},
    "stop_and_go": {"start": [10, 60], "vary": 0.5, "go_frames": 200.0},
    "straight_m": {"start_m": [-20, 5, 800], "velocity_m_s": [30, -2, 10]},
    "waypoints_m": {"points": [[-50, 0, 900], [0, 10, 1000], [60, -20, 950]], "frames": [0, 40, 90]},
    "weave_m": {"start_m": START, "tilt_deg": 60.0, "climb_m_s": 10.0, "axes": "world", "period_s": 4.0},
    "manoeuvre_m": {"start_m": START, "hold_s": 1.0, "keep_in_m": [-4000, -2000, 4000, 6000]},
    "turns_m": {"start_m": START, "turns": [[5, 50, 6.0]], "climb_m_s": 5.0},
    "dive": {"start_m": [-100, -50, 2000], "at_frame": 10.0, "pull_out_frame": 70.0},
    "singer_m": {"start_m": [0, 0, 1500], "velocity_m_s": [40, 0, 0], "axes": "world"},
    "jump_m": {"start_m": START, "hold_s": 0.4, "climb_m_s": -5.0},
    "stop_and_go_m": {"start_m": [-20, 5, 400], "vary": 0.5, "go_s": 7.0, "climb_m_s": 2.0},
    "follow": {"target": "leader", "lag_frames": 5.0, "offset_px": [3.0, -4.0], "farther_m": 20.0},
    "crosses": {"target": "leader", "at_frame": 40.0, "angle_deg": 40.0},
    "crosses_m": {"target": "leader", "at_frame": 40.0, "angle_deg": 40.0, "miss_m": 9.0, "tilt_deg": 30.0},
    "thrown": {"target": "leader", "at_frame": 30.0, "velocity_m_s": [3.0, 5.0, -9.0]},
}


@pytest.mark.parametrize("kind", PATHS.kinds)
def test_contract_of_each_path(kind: str) -> None:
    """A frame alone equals the frame in sequence; the path is continuous, also around frame 0."""
    value, frames = path(kind=kind, **EXAMPLES[kind]), np.arange(120.0)
    together = value.positions(frames, context(3), "jet")
    for frame in (0, 7, 119):
        alone = value.positions(frames[frame : frame + 1], context(3), "jet")
        np.testing.assert_array_equal(alone[0], together[frame])
    steps = np.linalg.norm(np.diff(value.positions(np.arange(0.0, 60.0, 0.05), context(), "jet"), axis=0), axis=1)
    for part in (steps[:598], steps[602:]):  # a thrown target changes its velocity at frame 30
        assert part.max() < 3 * np.median(part)
    around = value.positions(np.array([-0.01, 0.0, 0.01]), context(), "jet")
    np.testing.assert_allclose(around[1] - around[0], around[2] - around[1], atol=2e-3)


@pytest.mark.parametrize("kind", ["manoeuvre", "singer_m", "jump", "stop_and_go_m"])
def test_random_paths_depend_on_seed_and_name(kind: str) -> None:
    value, frames = path(kind=kind, **EXAMPLES[kind]), np.array([350.0])
    found = [value.positions(frames, context(seed), name) for seed, name in ((0, "jet"), (1, "jet"), (0, "other"))]
    assert len({each.tobytes() for each in found}) == 3


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31 - 1), speed=st.floats(5, 300), seconds=st.floats(0.1, 8), turn=st.floats(-60, 60))
def test_same_path_in_pixels_and_in_metres(seed: int, speed: float, seconds: float, turn: float) -> None:
    """10 m a px; x is ahead, y to the right."""
    scene, frames, scale = context(seed), seconds * RATE, 10.0
    box = [-60.0, -40.0, 60.0, 40.0]
    pace, sharpest = speed / RATE / scale, np.degrees(STANDARD_GRAVITY / speed / RATE)
    pairs: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
        "weave": (
            {"amplitude_m": 30.0, "period_s": seconds, "phase_deg": turn},
            {"amplitude_px": 3.0, "period_frames": frames, "phase_deg": turn},
        ),
        "stop_and_go": (
            {"go_s": seconds, "stop_s": seconds / 2, "vary": 0.4, "ease_s": 0.2},
            {"go_frames": frames, "stop_frames": frames / 2, "vary": 0.4, "ease_frames": 6.0},
        ),
        "jump": (
            {"rates_deg_s": [0.0, turn], "hold_s": seconds},
            {"rates_deg": [0.0, turn / RATE], "hold_frames": frames},
        ),
        "manoeuvre": (
            {"turn_g": 1.0, "hold_s": seconds, "keep_in_m": [-400, -600, 400, 600]},
            {"turn_deg": sharpest, "hold_frames": frames, "ease_frames": 15.0, "keep_in_px": box},
        ),
    }
    at = np.arange(-5.0, 90.0, 0.7)
    for kind, (metres, pixels) in pairs.items():
        level = path(kind=f"{kind}_m", axes="world", start_m=[0, 0, 0], heading_deg=0, speed_m_s=speed, **metres)
        drawn = path(kind=kind, start=[0, 0], speed=pace, **pixels)
        east, north, up = world(level, at, scene).T
        x, y = drawn.pixels(at, scene, "jet").T  # type: ignore[attr-defined]  # a PixelPath
        np.testing.assert_allclose(np.stack([north, east, up]), [scale * x, scale * y, 0 * x], atol=1e-6)


@pytest.mark.parametrize("kind", ["manoeuvre", "singer", "stop_and_go", "weave_m", "jump_m"])
@pytest.mark.parametrize("posture", POSTURES)
def test_attitude_of_a_frame_alone(kind: str, posture: Any) -> None:
    value, frames = path(kind=kind, **EXAMPLES[kind]), np.arange(0, 90, 0.5)
    turns = attitudes(value, frames, context(), "it", posture=POSTURES[posture])
    np.testing.assert_allclose(turns @ np.swapaxes(turns, 1, 2), [np.eye(3)] * len(turns), atol=1e-12)
    for one in (0, 57, 140):
        alone = attitudes(value, frames[one : one + 1], context(), "it", posture=POSTURES[posture])
        np.testing.assert_array_equal(alone[0], turns[one])


@pytest.mark.parametrize("kind", ["weave_m", "waypoints_m", "jump_m"])
def test_camera_on_a_path(kind: str) -> None:
    platform, frames = Platform.model_validate({"path": {"kind": kind, **EXAMPLES[kind]}}), np.array([0.0, 40.0])
    positions = path(kind=kind, **EXAMPLES[kind]).positions(frames, context(), "platform")
    np.testing.assert_allclose(platform.shifts(frames, context()), positions - positions[0], atol=1e-12)


WAYPOINTS = {"kind": "waypoints", "points": [[0, 0], [1, 1]]}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (WAYPOINTS, "neither 'frames' nor a speed is given"),
        ({**WAYPOINTS, "speed": 1.0, "frames": [0, 1]}, "exclude each other"),
        ({**WAYPOINTS, "frames": [0]}, "frames: 1, points: 2"),
        ({**WAYPOINTS, "frames": [5, 5]}, "do not rise"),
        ({**WAYPOINTS, "points": [[0, 0], [0, 0]], "speed": 1.0}, "consecutive points are equal"),
        ({"kind": "manoeuvre", "start": [0, 0], "keep_in_px": [10, 0, 5, 9]}, "box is empty"),
        ({"kind": "manoeuvre_m", "start_m": [0, 0, 9], "keep_in_m": [0, 5, 9, 5]}, "[west, south, east, north] that"),
        ({"kind": "turns", "start": [0, 0], "turns": [[0, 20, 1.0], [10, 30, 1.0]]}, "overlap"),
        ({"kind": "turns", "start": [0, 0], "turns": [[9, 9, 1.0]]}, "from frame 9"),
        ({"kind": "dive", "start_m": [0, 0, 0], "at_frame": 30, "pull_out_frame": 20}, "pull-out comes before"),
        ({"kind": "dive_px", "start": [0, 0], "at_frame": 30, "pull_out_frame": 30}, "pull-out comes before"),
    ],
)
def test_infeasible_path_is_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(Annotated[Path, PATHS]).validate_python(keys)
    assert words in str([error["msg"] for error in caught.value.errors()[0]["ctx"]["errors"]])


SCENE = """
frames: 120
camera: {{size: [320, 256], ifov_mrad: 0.5, elevation_deg: 3}}
atmosphere: {{surroundings_k: 280}}
background: {{kind: sky, horizon_k: 262, zenith_k: 240}}
targets:
  - id: leader
    shape: {{kind: fighter}}
    path: {{kind: straight_m, start_m: [-80, -10, 1200], velocity_m_s: [40, 0, 0]}}
  - {{id: it, shape: {{kind: fighter}}, path: {{{path}}}}}
"""


@pytest.mark.parametrize(
    "keys",
    [
        "kind: weave_m, start_m: [-70, 5, 1000], speed_m_s: 35, amplitude_m: 15, period_s: 2.5, tilt_deg: 60",
        "kind: crosses_m, target: leader, at_frame: 60, angle_deg: 60, tilt_deg: 60, miss_m: 9, speed_m_s: 50",
        "kind: dive_px, start: [280, 60], heading_deg: 180, angle_deg: 40, pull_out_frame: 100, range_m: 1200",
    ],
)
def test_truth_lies_on_the_path(keys: str) -> None:
    """Without warnings; two targets cross in the truth of the frame in which they pass."""
    scenario = loads(SCENE.format(path=keys))
    assert [notice.message for notice in lint(scenario)] == []
    renderer, value = Renderer(scenario), scenario.targets[1].path
    for frame in (0, 60, 110):
        leader, truth = renderer.scene(frame)[1].targets
        expected = scenario.context.geometry.project(value.positions(np.array([frame]), scenario.context, "it"))[0]
        np.testing.assert_allclose(truth.center, expected, atol=4)  # the middle of the visible side of 30 px
        assert "crosses" not in keys or leader.crossing == truth.crossing == (frame == 60)
