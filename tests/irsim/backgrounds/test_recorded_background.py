"""Recorded frames as background: unchanged pixels, inserted targets, scale and noise."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run

from irsim.backgrounds import Recorded
from irsim.camera.presets import PRESETS
from irsim.errors import InputError
from irsim.physics.radiometry import Scale, temperature
from irsim.recording import open_recording, record
from irsim.render.stream import Rendering
from irsim.scenario.loader import dumps, loads
from irsim.scenario.model import Scenario

SIZE = (64, 48)


def footage(folder: Path, frames: int = 5, bits: int = 14, **camera: Any) -> Path:
    """A small noisy recording."""
    scene = Scenario.model_validate(
        {
            "frames": frames,
            "camera": {"size": SIZE, "bits": bits, "range_k": (250.0, 330.0), **camera},
            "background": {"kind": "ground", "spread_k": 4.0},
        }
    )
    return record(Rendering(scene), folder / "own.mcap")


def scene(file: Path, background: dict[str, Any] | None = None, **keys: Any) -> Scenario:
    return Scenario.model_validate(
        {
            "frames": 12,
            "camera": {"size": SIZE, "bits": 14, **keys.pop("camera", {})},
            "background": {"kind": "recording", "file": str(file), **(background or {})},
            **keys,
        }
    )


TARGET = {
    "id": "hot",
    "shape": {"kind": "fighter"},
    "path": {"kind": "straight", "start": (30.0, 24.0), "speed": 0.5, "range_m": 1500.0},
}


def test_frames_without_targets_are_the_recording_s(tmp_path: Path) -> None:
    file = footage(tmp_path)
    own = [frame.image for frame in open_recording(file).frames()]
    looped = Rendering(scene(file, {"start": 1}))
    held = Rendering(scene(file, {"past_end": "hold"}))
    for index in (0, 11, 3, 4, 9):
        assert np.array_equal(looped.frame(index).image, own[(1 + index) % 5])
        assert np.array_equal(held.frame(index).image, own[min(index, 4)])


def test_an_inserted_target_has_truth_and_changes_no_more(tmp_path: Path) -> None:
    file = footage(tmp_path)
    own = open_recording(file).frame(2).image.astype(int)
    frame, truth = next(Rendering(scene(file, targets=[TARGET])).pairs(2, 3))
    (target,) = truth.targets
    changed = np.argwhere(frame.image.astype(int) != own)
    assert len(changed) > 4
    assert np.abs(changed[:, ::-1] - target.center).max() < 20
    assert target.visible == pytest.approx(1)
    assert target.contrast_k is not None
    assert target.contrast_k > 0


def test_the_camera_adds_no_second_noise(tmp_path: Path) -> None:
    file = footage(tmp_path)
    quiet, noisy = (
        Rendering(scene(file, camera={"netd_mk": netd}, targets=[TARGET])).frame(1).image for netd in (0.0, 500.0)
    )
    assert np.array_equal(quiet, noisy)


def test_inserted_objects_have_the_recorded_noise(tmp_path: Path) -> None:
    """Noise of 100 mK is as strong on a body that covers what is behind it, and on smoke that half covers it."""
    file = footage(tmp_path, frames=40, netd_mk=100.0)
    own = np.array([frame.image for frame in open_recording(file).frames()], dtype=float)
    plate = {"kind": "hot_spot", "size_m": (12.0, 8.0), "temperature_k": 315.0}
    path = {"kind": "straight", "start": (32.0, 24.0), "range_m": 1000.0}
    smoke = {"kind": "smoke", "range_m": 500.0, "center_px": (32.0, 24.0), "size_px": (30.0, 20.0), "opacity": 0.5}
    smoke |= {"billows": 0.0, "spread_k": 0.0}  # even: what rolls would count as noise
    for things in ({"targets": [{"id": "plate", "shape": plate, "path": path}]}, {"occluders": [smoke]}):
        rendered = Rendering(scene(file, frames=40, **things))
        counts = np.array([rendered.frame(k).image for k in range(40)], dtype=float)
        middle = (slice(None), slice(20, 29), slice(24, 41))
        assert counts[middle].mean() != pytest.approx(own[middle].mean(), abs=50)
        assert counts[middle].std(axis=0).mean() == pytest.approx(own[middle].std(axis=0).mean(), rel=0.1)


def test_the_temperature_range_is_the_recording_s(tmp_path: Path) -> None:
    file = footage(tmp_path)
    assert scene(file).background.range_k == (250.0, 330.0)  # type: ignore[attr-defined]  # it is a Recorded
    assert scene(file, {"range_k": (200.0, 500.0)}).background.range_k == (200.0, 500.0)  # type: ignore[attr-defined]  # it is a Recorded


def preset_scene(preset: str, **keys: Any) -> Scenario:
    """Even ground of 290 K, or what is given, as a camera of the trade sees it; two frames."""
    camera = {"preset": preset, "size": SIZE}
    ground = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.0}
    return Scenario.model_validate({"frames": 2, "camera": camera, "background": ground, **keys})


@pytest.mark.parametrize("preset", list(PRESETS))
def test_an_inserted_car_has_the_contrast_of_a_rendered_one(tmp_path: Path, preset: str) -> None:
    """320 K on ground of 290 K adds the counts that it adds where all is rendered, within noise and rounding."""
    file = record(Rendering(preset_scene(preset)), tmp_path / "ground.mcap")
    camera = preset_scene(preset).camera
    path = {"kind": "straight", "start": (32.0, 24.0), "range_m": 0.1 / camera.geometry.ifov_rad}
    cars = [{"id": "car", "shape": {"kind": "car", "temperature_k": 320.0}, "path": path}]
    put = Rendering(preset_scene(preset, background={"kind": "recording", "file": str(file)}, targets=cars))
    seen = Rendering(preset_scene(preset, targets=cars))
    own = Rendering(preset_scene(preset)).frame(1).image.astype(float)
    added, meant = (each.frame(1).image.astype(float) - own for each in (put, seen))
    (truth,) = put.truths(1, 2)
    box, sigma = truth.targets[0].box, max(camera.response().noise / camera.response().gain, 0.3)
    assert meant.sum() > 1000 * sigma
    assert added.sum() == pytest.approx(meant.sum(), rel=2e-3, abs=5 * sigma * (box.w * box.h) ** 0.5)
    (meant_truth,) = seen.truths(1, 2)
    assert truth.targets[0].contrast_k == pytest.approx(meant_truth.targets[0].contrast_k, abs=0.1)


@pytest.mark.parametrize("preset", ["cooled_mwir", "cooled_lwir"])
def test_photon_counts_give_the_scene_temperature(tmp_path: Path, preset: str) -> None:
    """Count 0 is no black body's and no range is written, but the camera's own curve."""
    file = record(Rendering(preset_scene(preset)), tmp_path / "ground.mcap")
    recording = open_recording(file)
    band = recording.camera.band
    assert recording.camera.range_k is None
    assert band is not None
    background = preset_scene(preset, background={"kind": "recording", "file": str(file)}).background
    assert isinstance(background, Recorded)
    counts = recording.frame(0).image.astype(np.float64).mean(keepdims=True)
    assert temperature(band, background.scale(band).light(counts)).item() == pytest.approx(290, abs=0.05)
    again = loads(dumps(preset_scene(preset, background=background))).background
    assert again == background
    # In another band its curve says nothing; a range that is given holds.
    assert background.scale("mwir").root == 0
    given = Recorded.model_validate({"file": str(file), "range_k": (250.0, 330.0)})
    assert given.scale(band) == Scale.between(band, (250.0, 330.0), recording.bits)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("file: nowhere.mcap", "nowhere.mcap"),
        ("file: OWN, start: 9", "allowed: 0 to 4"),
        ("file: OWN, range_k: [300, 250]", "the lower temperature first"),
        ("file: OWN, digest: abc", "has changed"),
    ],
)
def test_invalid_recordings_are_one_line_with_a_place(tmp_path: Path, keys: str, said: str) -> None:
    file = footage(tmp_path)
    text = f"camera: {{size: [64, 48], bits: 14}}\nbackground: {{kind: recording, {keys.replace('OWN', str(file))}}}\n"
    with pytest.raises(InputError, match=said) as raised:
        loads(text, "scene.yaml")
    assert str(raised.value).startswith("scene.yaml:2:")
    assert "\n" not in str(raised.value)


def test_a_camera_of_another_size_is_refused(tmp_path: Path) -> None:
    text = f"background: {{kind: recording, file: {footage(tmp_path)}}}\n"
    with pytest.raises(InputError, match=r"allowed: camera size: \[64, 48\], bits: 14"):
        loads(text)


def test_no_output_replaces_the_footage(tmp_path: Path, run: Run) -> None:
    file = footage(tmp_path)
    before, into = file.read_bytes(), Rendering(scene(file, targets=[TARGET]))
    assert into.needs == (file,)
    with pytest.raises(InputError, match=r"would replace .*own\.mcap, which this command needs"):
        record(into, file)
    (tmp_path / "into.yaml").write_text(dumps(into.scenario))
    done = run("render", "into.yaml", "-o", "own.mcap", "--frames", "2", cwd=tmp_path)
    assert done.returncode == 2
    kept = record(into, tmp_path / "into.mcap", stop=2)
    assert run("render", str(kept), "-o", "own.mcap", cwd=tmp_path).returncode == 2
    assert file.read_bytes() == before
