"""What paths in metres share with those in pixels, and what depends on them: bodies, cameras, scenes, warnings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_stage import GEOMETRY, level_axes, path
from motion_stage import context as staged

from irsim.errors import InputError
from irsim.lint import lint
from irsim.motion.attitude import POSTURES, STANDARD_GRAVITY, PostureName, attitudes
from irsim.motion.camera_motion import Platform
from irsim.render.frame import Renderer
from irsim.scenario.loader import loads


@given(seed=st.integers(0, 2**31 - 1), speed=st.floats(5, 300), seconds=st.floats(0.1, 8), turn=st.floats(-60, 60))
def test_both_forms_of_a_path_are_one_way_in_other_units(seed: int, speed: float, seconds: float, turn: float) -> None:
    """Pixels to metres by 10 m a px, frames to seconds by the rate; x is ahead, y to the right."""
    scene, frames, scale = staged(seed), seconds * 30.0, 10.0
    box = [-60.0, -40.0, 60.0, 40.0]
    pace, sharpest = speed / 30.0 / scale, np.degrees(STANDARD_GRAVITY / speed / 30.0)
    pairs: list[tuple[dict[str, Any], dict[str, Any]]] = [
        (
            {"kind": "weave_m", "amplitude_m": 30.0, "period_s": seconds, "phase_deg": turn},
            {"kind": "weave", "amplitude_px": 3.0, "period_frames": frames, "phase_deg": turn},
        ),
        (
            {"kind": "stop_and_go_m", "go_s": seconds, "stop_s": seconds / 2, "vary": 0.4, "ease_s": 0.2},
            {"kind": "stop_and_go", "go_frames": frames, "stop_frames": frames / 2, "vary": 0.4, "ease_frames": 6.0},
        ),
        (
            {"kind": "jump_m", "rates_deg_s": [0.0, turn], "hold_s": seconds},
            {"kind": "jump", "rates_deg": [0.0, turn / 30.0], "hold_frames": frames},
        ),
        (
            {"kind": "manoeuvre_m", "turn_g": 1.0, "hold_s": seconds, "keep_in_m": [-400, -600, 400, 600]},
            {"kind": "manoeuvre", "turn_deg": sharpest, "hold_frames": frames, "ease_frames": 15.0, "keep_in_px": box},
        ),
    ]
    at = np.arange(-5.0, 90.0, 0.7)
    for metres, pixels in pairs:
        level = path(axes="world", start_m=[0, 0, 0], heading_deg=0, speed_m_s=speed, **metres)
        drawn = path(start=[0, 0], speed=pace, **pixels)
        east, north, up = np.stack(level_axes()) @ level.positions(at, scene, "jet").T
        x, y = drawn.pixels(at, scene, "jet").T  # type: ignore[attr-defined]  # a PixelPath
        np.testing.assert_allclose(np.stack([north, east, up]), [scale * x, scale * y, 0 * x], atol=1e-6)


KINDS: dict[str, dict[str, Any]] = {
    "weave_m": {"start_m": [-20, 0, 100], "speed_m_s": 8, "amplitude_m": 3, "period_s": 2, "tilt_deg": 40},
    "manoeuvre_m": {"start_m": [-20, 0, 100], "speed_m_s": 8, "turn_g": 0.5},
    "jump_m": {"start_m": [-20, 0, 100], "speed_m_s": 8, "rates_deg_s": [0, 40, -40], "hold_s": 0.5},
    "stop_and_go_m": {"start_m": [-20, 0, 100], "speed_m_s": 8, "go_s": 1.5, "stop_s": 0.5, "ease_s": 0.5},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("posture", POSTURES)
def test_bodies_lie_along_them_and_each_frame_stands_alone(kind: str, posture: PostureName) -> None:
    value, frames = path(kind=kind, **KINDS[kind]), np.arange(0, 90, 0.5)
    turns = attitudes(value, frames, staged(), "it", posture=POSTURES[posture])
    np.testing.assert_allclose(turns @ np.swapaxes(turns, 1, 2), [np.eye(3)] * len(turns), atol=1e-12)
    if kind != "stop_and_go_m":  # what stands has no direction of its own
        along = value.positions(frames + 0.5, staged(), "it") - value.positions(frames - 0.5, staged(), "it")
        ahead = np.sum(turns[:, :, 0] * along, axis=1) / np.linalg.norm(along, axis=1)
        assert ahead.min() > 0.5
    for one in (0, 57, 140):
        alone = attitudes(value, frames[one : one + 1], staged(), "it", posture=POSTURES[posture])
        np.testing.assert_array_equal(alone[0], turns[one])


def test_an_aeroplane_banks_into_them() -> None:
    """Farthest from its line a level weave of 3.2 g is flown at a bank of atan(3.2), right wing up to the right."""
    value = path(kind="weave_m", start_m=[0, 0, 2000], heading_deg=0)
    body = attitudes(value, np.array([37.5]), staged(), "it", posture=POSTURES["aeroplane"])[0]
    bank = np.degrees(np.arctan2(body[:, 1] @ GEOMETRY.down, body[:, 2] @ GEOMETRY.down))
    assert bank == pytest.approx(-np.degrees(np.arctan(20 * (2 * np.pi / 5) ** 2 / STANDARD_GRAVITY)), abs=0.5)


@pytest.mark.parametrize("kind", KINDS)
def test_they_carry_a_camera_too(kind: str) -> None:
    platform = Platform.model_validate({"path": {"kind": kind, **KINDS[kind]}})
    frames = np.array([0.0, 40.0])
    way = path(kind=kind, **KINDS[kind]).positions(frames, staged(), "platform")
    np.testing.assert_allclose(platform.shifts(frames, staged()), way - way[0], atol=1e-12)


SCENE = """
frames: 120
camera: {{size: [320, 256], ifov_mrad: 0.5, elevation_deg: 3}}
atmosphere: {{surroundings_k: 280}}
background: {{kind: sky, horizon_k: 262, zenith_k: 240}}
targets:
  - id: leader
    shape: {{kind: fighter}}
    path: {{kind: straight_m, start_m: [-80, -10, 1200], velocity_m_s: [40, 0, 0]}}
  - {{id: it, shape: {{kind: {shape}}}, path: {{{path}}}}}
"""
NEWCOMERS = [
    ("fighter", "kind: weave_m, start_m: [-70, 5, 1000], speed_m_s: 35, amplitude_m: 15, period_s: 2.5, tilt_deg: 60"),
    ("quadrotor", "kind: manoeuvre_m, start_m: [0, -3, 100], speed_m_s: 5, turn_g: 0.5, keep_in_m: [-8, 80, 8, 140]"),
    ("fighter", "kind: jump_m, start_m: [-90, 20, 1500], speed_m_s: 60, rates_deg_s: [0, 30, -30], hold_s: 1"),
    ("quadrotor", "kind: stop_and_go_m, start_m: [-6, 0, 100], speed_m_s: 6, go_s: 1.5, stop_s: 1, ease_s: 0.5"),
    (
        "fighter",
        "kind: crosses_m, target: leader, at_frame: 60, angle_deg: 60, tilt_deg: 60, miss_m: 9, speed_m_s: 50",
    ),
    ("fighter", "kind: dive_px, start: [280, 60], heading_deg: 180, angle_deg: 40, pull_out_frame: 100, range_m: 1200"),
]


@pytest.mark.parametrize(("shape", "keys"), NEWCOMERS, ids=[keys.split(",")[0][6:] for _, keys in NEWCOMERS])
def test_a_first_scene_of_each_is_as_meant(shape: str, keys: str) -> None:
    """Nothing is warned of, and truth has the target in the picture, where its path says, from the first frame on."""
    scenario = loads(SCENE.format(shape=shape, path=keys))
    assert [notice.message for notice in lint(scenario)] == []
    renderer, value = Renderer(scenario), scenario.targets[1].path
    for frame in (0, 30, 60, 90):
        truth = next(target for target in renderer.scene(frame)[1].targets if target.id == "it")
        place = value.positions(np.array([float(frame)]), scenario.context, "it")
        told = scenario.context.geometry.project(place)[0]
        np.testing.assert_allclose(truth.center, told, atol=4)  # the middle of what is seen of a body of 30 px
        assert scenario.context.geometry.inside(*told)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("at_frame: 60", "at_frame: 120", "it.path.at_frame: there is no frame 120; allowed: 0 to 119"),
        ("at_frame: 60", "at_frame: 60, miss_deg: 45, miss_m: 300", "at_frame: it is outside the picture in frame 60"),
        ("start_m: [-80,", "start_m: [-280,", "it.path.at_frame: leader is outside the picture in frame 60"),
        ("angle_deg: 60", "angle_deg: 0", "it.path.angle_deg: at this speed and angle it never separates from leader"),
        ("target: leader", "target: it", "it.path.target: it refers to itself"),
    ],
)
def test_a_passing_that_cannot_happen_is_refused(old: str, new: str, line: str) -> None:
    text = SCENE.format(
        shape=NEWCOMERS[4][0], path=NEWCOMERS[4][1].replace("miss_m: 9, speed_m_s: 50", "speed_m_s: 40")
    )
    assert old in text
    with pytest.raises(InputError) as caught:
        loads(text.replace(old, new))
    assert line in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_two_that_pass_in_space_cross_in_the_truth() -> None:
    renderer = Renderer(loads(SCENE.format(shape=NEWCOMERS[4][0], path=NEWCOMERS[4][1])))
    crossing = [all(target.crossing for target in renderer.scene(frame)[1].targets) for frame in (10, 60, 110)]
    assert crossing == [False, True, False]
