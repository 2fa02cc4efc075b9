"""Warnings of recorded frames as the background: what they do not say, and what does nothing to them."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

import irsim
from irsim.errors import Notice
from irsim.lint import doubts
from irsim.recording import open_recording, record
from irsim.recording.importers import import_frames
from irsim.render.stream import Rendering

CAMERA = "size: [64, 48], bits: 14, band: [7.7, 9.3], rate_hz: 100, ifov_mrad: 0.3"
ELECTRONS = "detector: {kind: electrons, integration_ms: 0.4, f_number: 2, well_me: 12}"
CAR = "targets: [{id: car, shape: {kind: car}, path: {kind: straight, start: [32, 24], range_m: 500}}]"


def text(file: Path, camera: str = CAMERA, background: str = "", more: str = CAR) -> str:
    return f"frames: 3\ncamera: {{{camera}}}\nbackground: {{kind: recording, file: {file}{background}}}\n{more}\n"


def told(scene: str) -> list[Notice]:
    """Warnings of the recorded background and of the camera before it."""
    return [each for each in doubts(irsim.loads(scene)) if each.at[0] in ("background", "camera")]


def places(scene: str) -> list[str]:
    return [".".join(map(str, each.at)) for each in told(scene)]


@pytest.fixture
def counted(tmp_path: Path) -> Path:
    """A recording of a camera that counts photons."""
    scene = f"frames: 3\ncamera: {{{CAMERA}, {ELECTRONS}}}\nbackground: {{kind: ground, mean_k: 290}}\n"
    return record(Rendering(irsim.loads(scene)), tmp_path / "counted.mcap")


@pytest.fixture
def imported(tmp_path: Path) -> Path:
    """Pictures of 8 bits, of which nothing else is known."""
    folder = tmp_path / "png"
    folder.mkdir()
    for index in range(3):
        cv2.imwrite(str(folder / f"{index}.png"), np.full((48, 64), 80 + index, np.uint8))
    return import_frames(folder, tmp_path / "imported.mcap", rate_hz=30.0)


def test_a_camera_like_the_recordings_is_told_nothing(counted: Path) -> None:
    assert told(text(counted)) == []
    assert told(text(counted, "preset: cooled_lwir, size: [64, 48]")) == []


def test_an_unknown_scale_is_told_with_what_to_write(imported: Path) -> None:
    camera = "size: [64, 48], bits: 8"
    (notice,) = told(text(imported, camera))
    assert notice.at == ("background", "range_k")
    assert "imported.mcap stand for? it does not say: 220 K for count 0 and 400 K for the highest" in notice.message
    assert "range_k: [K of count 0, K of the highest count]" in notice.message
    assert told(text(imported, camera, ", range_k: [270, 320]")) == []
    assert told(text(imported, camera, more="")) == []  # nothing is drawn
    assert told(text(imported, camera, more=f"{CAR}\nwithout: [car]")) == []


def test_another_camera_than_the_recordings_is_told(counted: Path) -> None:
    band = "size: [64, 48], bits: 14, band: mwir, rate_hz: 100, ifov_mrad: 0.3"
    scale, other = told(text(counted, band))
    assert scale.at == ("background", "range_k")
    assert "for the band of its own camera only" in scale.message
    assert other.at == ("camera", "band")
    assert other.message.endswith("the recording's is band: [7.7, 9.3]")
    (rate,) = told(text(counted, CAMERA.replace("100", "25")))
    assert (rate.at, "passes 0.25 times as fast" in rate.message) == (("camera", "rate_hz"), True)
    (pixel,) = told(text(counted, CAMERA.replace("0.3", "0.6")))
    assert (pixel.at, "drawn is 0.5 times as large" in pixel.message) == (("camera", "ifov_mrad"), True)


@pytest.mark.parametrize(
    ("camera", "told_of"),
    [
        ("motion: [{kind: pan, azimuth_deg_s: 3}]", ["camera.motion.0"]),
        ("noise: [{kind: white, ratio: 100}]", ["camera.noise"]),
        ("netd_mk: 100", ["camera.netd_mk"]),
        ("range_k: [250, 320]", ["camera.range_k"]),
        ("time_constant_ms: 10", ["camera.time_constant_ms"]),
        ("falloff: {}", ["camera.falloff"]),
        ("correction: {}", ["camera.correction"]),
        ("bloom: {}", ["camera.bloom"]),
        (ELECTRONS, ["camera.detector"]),
        ("noise: [{kind: white}], netd_mk: 40", []),  # as where nothing is written
        ("psf_px: 0.8, smear: {time_ms: 5}, agc: {kind: fixed}", []),  # these hold for what is drawn, and all
    ],
)
def test_what_does_nothing_to_recorded_frames_is_told(counted: Path, camera: str, told_of: list[str]) -> None:
    assert places(text(counted, f"{CAMERA}, {camera}")) == told_of


def test_what_is_switched_off_is_not_told(counted: Path) -> None:
    camera = f"{CAMERA}, motion: [{{kind: pan, azimuth_deg_s: 3}}], falloff: {{}}, time_constant_ms: 10"
    assert len(places(text(counted, camera))) == 3
    assert places(text(counted, camera, more=f"{CAR}\nwithout: [pan, falloff, lag]")) == []


def test_what_is_drawn_moves_with_the_camera_and_recorded_frames_do_not(counted: Path) -> None:
    moved = irsim.loads(text(counted, f"{CAMERA}, motion: [{{kind: pan, azimuth_deg_s: 3}}]"))
    centers = [truth.targets[0].center[0] for truth in Rendering(moved).truths()]
    assert np.diff(centers) == pytest.approx(-np.radians(3) / 100 / 0.3e-3, rel=0.02)
    empty = moved.model_copy(update={"targets": ()})
    for frame, own in zip(Rendering(empty).frames(), open_recording(counted).frames(), strict=True):
        assert np.array_equal(frame.image, own.image)


@pytest.mark.parametrize("background", ["", ", range_k: [250, 330]"])
def test_a_recording_of_recorded_frames_has_their_scale(tmp_path: Path, counted: Path, background: str) -> None:
    """The camera's own range_k, which does nothing here, is not written into it."""
    again = Rendering(irsim.loads(text(counted, CAMERA, background)))
    facts = open_recording(record(again, tmp_path / "again.mcap")).camera
    given = (250.0, 330.0) if background else None
    assert (facts.range_k, facts.curve) == (given, None if background else open_recording(counted).camera.curve)


def test_a_recording_of_frames_of_unknown_scale_says_none(tmp_path: Path, imported: Path) -> None:
    again = Rendering(irsim.loads(text(imported, "size: [64, 48], bits: 8")))
    facts = open_recording(record(again, tmp_path / "again.mcap")).camera
    assert (facts.range_k, facts.curve) == (None, None)
