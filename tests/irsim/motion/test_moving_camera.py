"""Frames of a camera that zooms, is carried along and follows a target: truth against noiseless pictures."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from irsim import loads
from irsim.backgrounds.chart import Chart
from irsim.geometry.projection import Geometry
from irsim.lint.warnings import warnings
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario

SCENE = """
frames: 40
camera: {size: [160, 120], netd_mk: 0, elevation_deg: 10, motion: MOTION}
background: {kind: sky, horizon_k: 20, zenith_k: 20}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [60, 50], speed: 0.7, range_m: 1500}}
"""

MOTIONS = [
    "[{kind: zoom, factors: [[0, 1], [39, 2.5]]}]",
    "[{kind: platform, velocity_m_s: [8, 0, 2]}]",
    "[{kind: platform, path: {kind: turns_m, start_m: [0, 0, 0], speed_m_s: 30, turns: [[5, 30, 120]]}}]",
    "[{kind: tracks, target: jet, lag_s: 0.05}, {kind: zoom, factors: [[5, 1.5]]}, {kind: shake, rms_px: 1}]",
]


@pytest.mark.parametrize("motion", MOTIONS)
def test_truth_is_the_centroid_of_a_noiseless_picture(motion: str) -> None:
    renderer = Renderer(loads(SCENE.replace("MOTION", motion)))
    for frame in (0, 13, 39):
        light, truth = renderer.scene(frame)
        y, x = np.indices(light.shape)
        total = light.sum(dtype=np.float64)
        found = ((x * light).sum(dtype=np.float64) / total, (y * light).sum(dtype=np.float64) / total)
        assert truth.targets[0].signal_center == pytest.approx(found, abs=0.01)


@pytest.mark.parametrize("motion", MOTIONS)
def test_velocity_is_the_displacement_since_the_frame_before(motion: str) -> None:
    renderer = Renderer(loads(SCENE.replace("MOTION", motion).replace("fighter", "point")))
    (before,), (now,) = renderer.scene(20)[1].targets, renderer.scene(21)[1].targets
    assert now.velocity == pytest.approx(np.subtract(now.center, before.center), abs=1e-9)


@pytest.mark.parametrize(
    ("motion", "background", "path", "told"),
    [
        ("velocity_m_s: [0, 9, -3]", "landscape, camera_height_m: 10", "", "frame 100 the camera reaches"),
        ("velocity_m_s: [0, 9, -3]", "sea, camera_height_m: 9.2", "", "frame 91 the camera reaches the sea"),
        ("velocity_m_s: [0, 9, -3]", "landscape, camera_height_m: 13", "", None),
        ("velocity_m_s: [0, 9, -3]", "ground", "", None),
        ("velocity_m_s: [0, 9, -3]", "ground", ", ground_m: 10", "it sinks by 12 m"),
        ("sway_m: [0, 0, 4]", "sea, camera_height_m: 3", "", "it sinks by 4 m"),
        ("path: {kind: waypoints_m, points: [[0, 0, 50], [0, 99, 20]], speed_m_s: 9}", "landscape", "", "below its fi"),
        ("velocity_m_s: [0, 7.3, 0]", "ground, height_m: 0.05", "", None),  # level, but for 1e-16 m of rounding
        ("velocity_m_s: [0, 7.3, 0]", "ground", ", ground_m: 0.05", None),
    ],
)
def test_a_camera_that_is_carried_below_the_ground_is_told(
    tmp_path: Path, motion: str, background: str, path: str, told: str | None
) -> None:
    """It sinks by 0.1 m a frame, and is drawn from 0.1 m above the ground at least."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "frames: 121\ncamera: {size: [64, 48], elevation_deg: -4,\n"
        f" motion: [{{kind: pan}}, {{kind: platform, {motion}}}]}}\nbackground: {{kind: {background}}}\n"
        f"targets: [{{id: car, shape: {{kind: car}}, path: {{kind: straight, start: [30, 20]{path}}}}}]\n"
    )
    lines = [line for line in warnings(scene) if "camera.motion" in line]
    assert len(lines) == (told is not None)
    assert all(f"{scene}:3:24: camera.motion.platform: warning: at " in line and str(told) in line for line in lines)


@pytest.mark.parametrize(
    ("background", "path", "told"),
    [
        (
            "sea, camera_height_m: 20",
            "start_m: [0, 900, 0], velocity_m_s: [0, 0, -6]",
            "at frame 106 jet goes below",
        ),
        (
            "landscape, camera_height_m: 20",
            "start_m: [0, 900, -50]",
            "frame 0 jet goes below the ground, 20 m under the",
        ),
        ("landscape, camera_height_m: 20", "start_m: [0, 900, -20.5]", None),
        ("ground", "start_m: [0, 900, -50]", None),
    ],
)
def test_a_path_below_the_ground_is_told(tmp_path: Path, background: str, path: str, told: str | None) -> None:
    """It sinks by 0.2 m a frame, and may be 1 m lower than level ground."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        f"frames: 121\ncamera: {{size: [64, 48], elevation_deg: -1}}\nbackground: {{kind: {background}}}\n"
        f"targets: [{{id: jet, shape: {{kind: fighter}}, path: {{kind: straight_m, axes: world, {path}}}}}]\n"
    )
    lines = [line for line in warnings(scene) if "goes below" in line]
    assert len(lines) == (told is not None)
    assert all(f"{scene}:4:51: targets.jet.path: warning: at " in line and str(told) in line for line in lines)


def test_a_zoomed_camera_sees_a_smaller_part_of_the_background() -> None:
    level = Geometry((160, 120), 5e-4)
    wide, near = (Chart.at(level, np.eye(3), lens=level.zoomed(factor)) for factor in (1.0, 4.0))
    # Half a frame is 80 px x 0.5 mrad = 40 mrad wide: atan(0.04) against atan(0.01), in px of the map.
    assert wide.at_pixels(wide.u)[60, -1] == pytest.approx(np.arctan(79.5 * 5e-4) / 5e-4, abs=1e-3)
    assert near.at_pixels(near.u)[60, -1] == pytest.approx(np.arctan(79.5 * 5e-4 / 4) / 5e-4, abs=1e-3)


def test_a_platform_on_a_path_passes_what_is_near() -> None:
    """20 m to the right and then 20 m ahead: a bar 100 m away, 40 px of 5 mrad to the right at first, stands at
    100 m (sin, cos) of atan(0.2) less (20, 20) m then; a jet that was 1500 m straight ahead, at (-20, 1480) m."""
    way = "path: {kind: waypoints_m, axes: world, points: [[0, 0, 0], [20, 0, 0], [20, 20, 0]], frames: [0, 15, 30]}"
    near = "occluders: [{kind: bar, center_px: [119.5, 59.5], size_px: [2, 2], range_m: 100}]\n"
    text = SCENE.replace("MOTION", f"[{{kind: platform, {way}}}]").replace("elevation_deg: 10", "ifov_mrad: 5") + near
    for old, new in {"fighter": "point", "[60, 50]": "[79.5, 59.5]", "speed: 0.7": "speed: 0.0"}.items():
        text = text.replace(old, new)
    renderer = Renderer(loads(text))
    drawn = renderer.occluders[0].draw(renderer.pose(30))
    assert drawn is not None
    angle = math.atan(40 * 5e-3)
    right, ahead = 100 * math.sin(angle) - 20, 100 * math.cos(angle) - 20
    assert drawn.center[0] == pytest.approx(79.5 + right / ahead / 5e-3, abs=0.01)
    (jet,) = renderer.scene(30)[1].targets
    assert jet.center[0] == pytest.approx(79.5 - 20 / 1480 / 5e-3, abs=0.01)


def test_a_platform_moves_near_things_before_far_ones() -> None:
    """At 10 m/s to the right, after a second: 10 m / range / 0.5 mrad to the left."""
    motion = "[{kind: platform, velocity_m_s: [10, 0, 0]}]"
    near = "occluders: [{kind: bar, center_px: [100, 60], size_px: [4, 30], range_m: 500}]\n"
    renderer = Renderer(loads(SCENE.replace("MOTION", motion).replace("speed: 0.7", "speed: 0.0") + near))
    screen = renderer.occluders[0]
    before, after = (screen.draw(renderer.pose(frame)) for frame in (0, 30))
    assert before is not None
    assert after is not None
    assert after.center[0] - before.center[0] == pytest.approx(-10 / 500 / 5e-4, abs=0.1)
    (first,), (last,) = renderer.scene(0)[1].targets, renderer.scene(30)[1].targets
    assert last.center[0] - first.center[0] == pytest.approx(-10 / 1500 / 5e-4, abs=0.1)
    assert first.range_m is not None
    assert last.range_m == pytest.approx(np.hypot(first.range_m, 10), abs=0.2)


@pytest.mark.parametrize("standing", ["trees", "buildings"])
def test_rows_that_a_camera_has_gone_through_are_behind_it(standing: str) -> None:
    background = {
        "kind": "landscape",
        "camera_height_m": 10.0,
        standing: [{"id": "row", "range_m": 60.0, "spacing_m": 12.0}],
    }
    camera = {"size": [160, 120], "ifov_mrad": 1.0, "motion": [{"kind": "platform", "velocity_m_s": [0, 100, 0]}]}
    path = {"kind": "straight", "start": [80, 30], "range_m": 9000.0}
    target = {"id": "drone", "shape": {"kind": "quadrotor", "length_m": 50.0}, "path": path}
    renderer = Renderer(
        Scenario.model_validate({"frames": 60, "camera": camera, "background": background, "targets": [target]})
    )
    row = next(layer for layer in renderer.layers if layer.name == "row")
    passed = [row.light(renderer.now.view_direction(frame))[0] for frame in (0, 25, 59)]  # 60 m are gone at frame 18
    assert [bool((each < 0.5).any()) for each in passed if each is not None] == [True, False, False]
    for frame in (25, 59):
        (drone,) = renderer.scene(frame)[1].targets
        assert drone.visible is not None
        assert drone.visible > 0.99
        assert not drone.occluders
