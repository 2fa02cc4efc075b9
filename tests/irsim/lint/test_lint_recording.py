"""Warnings about recorded frames as the background."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

import irsim
from irsim.lint import lint
from irsim.recording import open_recording, record
from irsim.recording.importers import import_frames
from irsim.render.stream import Rendering

CAMERA = "size: [64, 48], bits: 14, band: [7.7, 9.3], rate_hz: 100, ifov_mrad: 0.3"
ELECTRONS = "detector: {kind: electrons, integration_ms: 0.4, f_number: 2, well_me: 12}"
CAR = "targets: [{id: car, shape: {kind: car}, path: {kind: straight, start: [32, 24], range_m: 500}}]"
GREY = "size: [64, 48], bits: 8"


def text(file: Path, camera: str = CAMERA, background: str = "", more: str = CAR) -> str:
    return f"frames: 3\ncamera: {{{camera}}}\nbackground: {{kind: recording, file: {file}{background}}}\n{more}\n"


def warned(scene: str) -> dict[str, str]:
    """Return the messages about background and camera by place."""
    found = [notice for notice in lint(irsim.loads(scene)) if notice.at[0] in ("background", "camera")]
    return {".".join(map(str, notice.at)): notice.message for notice in found}


@pytest.fixture
def counted(tmp_path: Path) -> Path:
    """A recording of a camera that counts photons."""
    scene = f"frames: 3\ncamera: {{{CAMERA}, {ELECTRONS}}}\nbackground: {{kind: ground, mean_k: 290}}\n"
    return record(Rendering(irsim.loads(scene)), tmp_path / "counted.mcap")


@pytest.fixture
def imported(tmp_path: Path) -> Path:
    """Pictures of 8 bits of unknown scale."""
    folder = tmp_path / "png"
    folder.mkdir()
    for index in range(3):
        cv2.imwrite(str(folder / f"{index}.png"), np.full((48, 64), 80 + index, np.uint8))
    return import_frames(folder, tmp_path / "imported.mcap", rate_hz=30.0)


def test_unknown_scale(imported: Path) -> None:
    message = warned(text(imported, GREY))["background.range_k"]
    assert "imported.mcap are unknown (it does not say): 220 K for count 0 and 400 K for the highest" in message
    assert "range_k: [K of count 0, K of the highest count]" in message
    assert warned(text(imported, GREY, ", range_k: [270, 320]")) == {}
    assert warned(text(imported, GREY, more=f"{CAR}\nwithout: [car]")) == {}


def test_other_camera(counted: Path) -> None:
    assert warned(text(counted)) == {}
    band = warned(text(counted, "size: [64, 48], bits: 14, band: mwir, rate_hz: 100, ifov_mrad: 0.3"))
    assert list(band) == ["background.range_k", "camera.band"]
    assert "for its own band only" in band["background.range_k"]
    assert band["camera.band"].endswith("the recording's is band: [7.7, 9.3]")
    rate = warned(text(counted, CAMERA.replace("100", "25")))
    assert "plays 0.25 times as fast" in rate["camera.rate_hz"]
    pixel = warned(text(counted, CAMERA.replace("0.3", "0.6")))
    assert "drawn objects are 0.5 times as large" in pixel["camera.ifov_mrad"]


@pytest.mark.parametrize(
    ("camera", "place"),
    [
        ("motion: [{kind: pan, azimuth_deg_s: 3}]", "camera.motion.0"),
        ("noise: [{kind: white, ratio: 100}]", "camera.noise"),
        ("range_k: [250, 320]", "camera.range_k"),
        ("falloff: {}", "camera.falloff"),
        (ELECTRONS, "camera.detector"),
        ("noise: [{kind: white}], netd_mk: 40", None),  # the defaults
        ("psf_px: 0.8, smear: {time_ms: 5}, agc: {kind: fixed}", None),  # these apply to drawn objects, and to all
    ],
)
def test_camera_keys_without_effect(counted: Path, camera: str, place: str | None) -> None:
    assert list(warned(text(counted, f"{CAMERA}, {camera}"))) == ([] if place is None else [place])


def test_disabled_camera_keys(counted: Path) -> None:
    camera = f"{CAMERA}, motion: [{{kind: pan, azimuth_deg_s: 3}}], falloff: {{}}, time_constant_ms: 10"
    assert len(warned(text(counted, camera))) == 3
    assert warned(text(counted, camera, more=f"{CAR}\nwithout: [pan, falloff, lag]")) == {}


def test_camera_motion_moves_only_drawn_objects(counted: Path) -> None:
    moved = irsim.loads(text(counted, f"{CAMERA}, motion: [{{kind: pan, azimuth_deg_s: 3}}]"))
    centers = [truth.targets[0].center[0] for truth in Rendering(moved).truths()]
    assert np.diff(centers) == pytest.approx(-np.radians(3) / 100 / 0.3e-3, rel=0.02)
    empty = moved.model_copy(update={"targets": ()})
    for frame, own in zip(Rendering(empty).frames(), open_recording(counted).frames(), strict=True):
        assert np.array_equal(frame.image, own.image)
