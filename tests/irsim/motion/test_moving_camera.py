"""Frames of a camera that zooms, moves and follows a target: truth against noiseless pictures."""

from __future__ import annotations

import math

import numpy as np
import pytest

from irsim import loads
from irsim.backgrounds.chart import Chart
from irsim.geometry.projection import Geometry
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
    """The velocity is the displacement since the frame before."""
    renderer = Renderer(loads(SCENE.replace("MOTION", motion)))
    for frame in (0, 39):
        light, truth = renderer.scene(frame)
        y, x = np.indices(light.shape)
        total = light.sum(dtype=np.float64)
        found = ((x * light).sum(dtype=np.float64) / total, (y * light).sum(dtype=np.float64) / total)
        assert truth.targets[0].signal_center == pytest.approx(found, abs=0.01)
    points = Renderer(loads(SCENE.replace("MOTION", motion).replace("fighter", "point")))
    (before,), (now,) = points.scene(20)[1].targets, points.scene(21)[1].targets
    assert now.velocity == pytest.approx(np.subtract(now.center, before.center), abs=1e-9)


def test_zoomed_background() -> None:
    level = Geometry((160, 120), 5e-4)
    wide, near = (Chart.at(level, np.eye(3), lens=level.zoomed(factor)) for factor in (1.0, 4.0))
    # Half a frame is 80 px x 0.5 mrad = 40 mrad wide: atan(0.04) against atan(0.01), in px of the map.
    assert wide.at_pixels(wide.u)[60, -1] == pytest.approx(np.arctan(79.5 * 5e-4) / 5e-4, abs=1e-3)
    assert near.at_pixels(near.u)[60, -1] == pytest.approx(np.arctan(79.5 * 5e-4 / 4) / 5e-4, abs=1e-3)


def test_parallax_of_near_objects() -> None:
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


@pytest.mark.parametrize("standing", ["trees", "buildings"])
def test_passed_rows_are_not_drawn(standing: str) -> None:
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
    views = [renderer.now(frame).view_direction(frame) for frame in (0, 25, 59)]  # 60 m are gone at frame 18
    passed = [row.light(view)[0] for view in views]
    assert [bool((each < 0.5).any()) for each in passed if each is not None] == [True, False, False]
    for frame in (25, 59):
        (drone,) = renderer.scene(frame)[1].targets
        assert drone.visible is not None
        assert drone.visible > 0.99
        assert not drone.occluders
