"""Camera pose of each frame in truth and recording, and the map of distant points between frames."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import irsim
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import CameraMotion
from irsim.recording.messages import TruthMessage, decode_truth, encode_truth
from irsim.render.frame import Renderer
from irsim.types import Floats, Pose, Truth

SIZE = (320, 240)
SCENE = """
frames: 24
camera:
  size: [320, 240]
  ifov_mrad: 0.3
  elevation_deg: 12
  rate_hz: 30
  motion:
    - {kind: pan, azimuth_deg_s: 1, elevation_deg_s: -0.5}
    - {kind: jitter, rms_px: 4}
    - {kind: "test_pose:Roll"}
    - {kind: zoom, factors: [[0, 1.0], [23, 1.3]]}
background: {kind: sky, horizon_k: 275, zenith_k: 275}
targets:
  - {id: star, shape: {kind: point, area_m2: 4}, path: {kind: straight, start: [190, 100], speed: 0, range_m: 30000}}
"""
CLOUDS = {
    "targets": [],
    "background.clouds": [{"coverage": 0.5, "depth": 0.6, "temperature_k": 250, "texture_k": 2, "range_m": 9000}],
}


class Roll(CameraMotion):
    """Roll at a constant rate, which no shipped motion has."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        return np.stack([0 * frames, 0 * frames, np.radians(1.0) * frames], axis=-1)


def mapped(matrix: Floats, pixels: Floats) -> Floats:
    """Return pixels (n, 2) mapped by a homography."""
    found = np.concatenate([pixels, np.ones((len(pixels), 1))], axis=1) @ matrix.T
    return np.asarray(found[:, :2] / found[:, 2:])


def test_homography_is_the_projection_of_distant_points() -> None:
    rng = np.random.default_rng(0)
    pixels = rng.uniform((0, 0), SIZE, (50, 2))
    before = Pose(300.0, 40.0, 20.0, 3e-4)
    after = Pose(301.0, 39.5, 50.0, 1e-4)
    geometries = [Geometry(SIZE, pose.ifov_rad) for pose in (before, after)]
    turns = [np.radians([pose.azimuth_deg, pose.elevation_deg, pose.roll_deg]) for pose in (before, after)]
    world = geometries[0].directions(pixels) @ geometries[0].world_rotation(turns[0])
    wanted = geometries[1].project(world @ geometries[1].world_rotation(turns[1]).T)
    np.testing.assert_allclose(mapped(irsim.homography(before, after, SIZE), pixels), wanted, atol=1e-8)
    np.testing.assert_allclose(mapped(irsim.homography(before, before, SIZE), pixels), pixels, atol=1e-9)


def test_a_distant_point_stays_within_a_twentieth_pixel() -> None:
    """The centroid of the rendered light is where the poses put it."""
    renderer = Renderer(irsim.loads(SCENE))
    first = renderer.scene(0)[1]
    for index in (1, 5, 12, 23):
        light, truth = renderer.scene(index)
        ((x, y),) = mapped(irsim.homography(first.pose, truth.pose, SIZE), np.array([first.targets[0].center]))
        column, row = round(x), round(y)
        patch = light[row - 8 : row + 9, column - 8 : column + 9].astype(np.float64)
        patch -= np.median(patch)
        rows, columns = np.mgrid[row - 8 : row + 9, column - 8 : column + 9]
        found = (patch * columns).sum() / patch.sum(), (patch * rows).sum() / patch.sum()
        assert found == pytest.approx((x, y), abs=0.05)
        assert truth.targets[0].center == pytest.approx((x, y), abs=1e-3)


def test_a_still_background_stays_within_a_twentieth_pixel() -> None:
    renderer = Renderer(irsim.change(irsim.loads(SCENE), CLOUDS))
    first, before = renderer.scene(0)
    for index in (1, 12, 23):
        last, after = renderer.scene(index)
        matrix = irsim.homography(before.pose, after.pose, SIZE)
        moved = cv2.warpPerspective(first, matrix, SIZE, flags=cv2.INTER_CUBIC)
        inner = slice(60, 180), slice(80, 240)
        still = np.eye(2, 3, dtype=np.float32)
        likeness, rest = cv2.findTransformECC(moved[inner], last[inner], still, cv2.MOTION_TRANSLATION)
        assert likeness > 0.999
        assert rest[:, 2] == pytest.approx((0, 0), abs=0.05)


def test_recordings_hold_the_pose_by_value(tmp_path: Path) -> None:
    motion = [{"kind": "platform", "velocity_m_s": [6, 3, -1.5]}, {"kind": "jitter"}]
    source = irsim.Rendering(irsim.change(irsim.loads(SCENE), {"camera.motion": motion}))
    recording = irsim.open_recording(irsim.record(source, tmp_path / "p.mcap", stop=3))
    wanted = list(source.truths(0, 3))
    assert list(recording.truths()) == wanted
    poses = [truth.pose for truth in wanted if truth.pose is not None]
    assert len(set(poses)) == 3
    assert poses[2].place_m == pytest.approx(np.array([6, 3, -1.5]) * 2 / 30)


def test_truths_without_a_pose_are_read() -> None:
    truth = Truth(3, 0.1, (), Pose(1.0, 2.0, 3.0, 4e-4, (5.0, 6.0, 7.0)))
    assert decode_truth(encode_truth(truth), 3, 0.1) == truth
    message = TruthMessage.FromString(encode_truth(truth))
    message.ClearField("pose")
    assert decode_truth(message.SerializeToString(), 3, 0.1).pose is None


@pytest.mark.parametrize(
    ("field", "value"), [("azimuth_deg", np.nan), ("roll_deg", None), ("ifov_rad", 0.0), ("place_m", None)]
)
def test_a_damaged_pose_is_an_error(field: str, value: float | None) -> None:
    message: Any = TruthMessage.FromString(encode_truth(Truth(0, 0.0, (), Pose(1.0, 2.0, 3.0, 4e-4))))
    if value is None:
        message.pose.ClearField(field)
    else:
        setattr(message.pose, field, value)
    with pytest.raises(ValueError, match=r"pose|place_m"):
        decode_truth(message.SerializeToString(), 0, 0.0)


def test_recorded_backgrounds_and_old_recordings_have_no_pose(tmp_path: Path) -> None:
    reference = Path(__file__).parents[3] / "recordings" / "reference" / "car.mcap"
    recording = irsim.open_recording(reference)
    truth = recording.truth(0)
    assert truth is not None
    assert truth.pose is None
    footage = irsim.loads(
        f"frames: 2\ncamera: {{size: [{recording.size[0]}, {recording.size[1]}], bits: {recording.bits}}}\n"
        f"background: {{kind: recording, file: {reference}, range_k: [210, 420]}}\n"
        "targets: [{id: a, shape: {kind: point}, path: {kind: straight, start: [30, 30]}}]\n"
    )
    assert next(irsim.frames(footage))[1].pose is None
