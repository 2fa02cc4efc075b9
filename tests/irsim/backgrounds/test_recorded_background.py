"""Recorded frames as background: unchanged pixels, inserted targets, scale, and the recorded noise on objects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from command_line import Run

from irsim.backgrounds import Recorded
from irsim.backgrounds.recorded import folded, recorded_noise
from irsim.camera.presets import PRESETS
from irsim.errors import InputError
from irsim.physics.radiometry import Scale, temperature
from irsim.recording import open_recording, record
from irsim.recording.importers import import_frames
from irsim.render.stream import Rendering
from irsim.scenario.loader import dumps, loads
from irsim.scenario.model import Scenario
from irsim.types import Floats

SIZE = (64, 48)
TARGET = {
    "id": "hot",
    "shape": {"kind": "fighter"},
    "path": {"kind": "straight", "start": (30.0, 24.0), "speed": 0.5, "range_m": 1500.0},
}


def scene(background: dict[str, Any], **keys: Any) -> Scenario:
    camera = {"size": SIZE, "bits": 14, **keys.pop("camera", {})}
    return Scenario.model_validate({"frames": 12, "camera": camera, "background": background, **keys})


def footage(folder: Path, spread_k: float = 4.0, **keys: Any) -> Path:
    """Return a small noisy recording of five frames."""
    ground = {"kind": "ground", "mean_k": 290.0, "spread_k": spread_k}
    keys["camera"] = {"range_k": (250.0, 330.0), **keys.get("camera", {})}
    return record(Rendering(scene(ground, **{"frames": 5, **keys})), folder / "own.mcap")


def on(file: Path, **background: Any) -> dict[str, Any]:
    return {"kind": "recording", "file": str(file), **background}


def counts(source: Any) -> Floats:
    return np.array([frame.image for frame in source.frames()], float)


def test_frames_without_targets_are_those_of_the_recording(tmp_path: Path) -> None:
    file = footage(tmp_path)
    own = [frame.image for frame in open_recording(file).frames()]
    looped, held = (Rendering(scene(on(file, **keys))) for keys in ({"start": 1}, {"past_end": "hold"}))
    for index in (0, 11, 3, 4):
        assert np.array_equal(looped.frame(index).image, own[(1 + index) % 5])
        assert np.array_equal(held.frame(index).image, own[min(index, 4)])


def test_an_inserted_target_changes_its_pixels_only(tmp_path: Path) -> None:
    """It has truth, and the camera's own noise has no effect."""
    file = footage(tmp_path)
    own = open_recording(file).frame(2).image.astype(int)
    frame, truth = next(Rendering(scene(on(file), targets=[TARGET])).pairs(2, 3))
    (target,) = truth.targets
    changed = np.argwhere(frame.image.astype(int) != own)
    assert len(changed) > 4
    assert np.abs(changed[:, ::-1] - target.center).max() < 20
    assert target.visible == pytest.approx(1)
    assert target.contrast_k is not None
    assert target.contrast_k > 0
    noisy = Rendering(scene(on(file), camera={"netd_mk": 500.0}, targets=[TARGET]))
    assert np.array_equal(noisy.frame(2).image, frame.image)


PLATE = {
    "id": "plate",
    "shape": {"kind": "hot_spot", "size_m": (12.0, 8.0), "temperature_k": 320.0},
    "path": {"kind": "straight", "start": (32.0, 24.0), "range_m": 2000.0},
}
BAR = {"kind": "bar", "center_px": (32.0, 24.0), "size_px": (36.0, 28.0), "range_m": 100.0}
COVERED = np.s_[:, 13:36, 17:48]
"""Well within the bar."""
APART = np.s_[:, :7, :]
"""Far from all objects."""


@pytest.mark.parametrize("targets", [[], [PLATE]])
def test_an_occluder_hides_recorded_objects_and_keeps_noise(tmp_path: Path, targets: list[dict[str, Any]]) -> None:
    """The recorded noise is as strong on the occluder as beside it, and normal; other pixels are unchanged."""
    file = footage(tmp_path, 0.0, targets=targets, camera={"netd_mk": 50.0, "psf_px": 0.4}, frames=6)
    own = counts(open_recording(file))
    barred = counts(Rendering(scene(on(file), frames=6, camera={"psf_px": 0.4}, occluders=[BAR])))
    noise = own[APART].std()
    off = barred[COVERED] - np.median(barred[COVERED])
    assert off.std() == pytest.approx(noise, rel=0.06)
    assert np.abs(off).max() < 4.5 * noise
    assert np.array_equal(barred[APART], own[APART])
    if targets:
        assert np.abs(own[COVERED] - np.median(own[APART])).max() > 50 * noise
    else:
        # A normal distribution has 68.3 % within 1 sigma; one pixel in nine is the median itself.
        assert (np.abs(off) < off.std()).mean() == pytest.approx(0.683, abs=0.06)
        assert np.corrcoef(off.ravel(), own[COVERED].ravel())[0, 1] > 0.9


def test_smoke_keeps_the_noise_of_its_share(tmp_path: Path) -> None:
    file = footage(tmp_path, frames=40, camera={"netd_mk": 100.0})
    smoke = {"kind": "smoke", "range_m": 500.0, "center_px": (32.0, 24.0), "size_px": (30.0, 20.0), "opacity": 0.5}
    smoke |= {"billows": 0.0, "spread_k": 0.0}  # rolling billows would count as noise
    middle = np.s_[:, 20:29, 24:41]
    own = counts(open_recording(file))[middle]
    covered = counts(Rendering(scene(on(file), frames=40, occluders=[smoke])))[middle]
    assert covered.mean() != pytest.approx(own.mean(), abs=50)
    assert covered.std(axis=0).mean() == pytest.approx(own.std(axis=0).mean(), rel=0.1)


def noisy_image(sigma: float) -> npt.NDArray[np.uint16]:
    return np.rint(np.random.default_rng(1).normal(8000.3, sigma, (256, 256))).astype(np.uint16)


@pytest.mark.parametrize("sigma", [0.2, 0.8, 4.0, 400.0])
def test_noise_finer_or_coarser_than_counts_is_kept(sigma: float) -> None:
    image = noisy_image(sigma)
    assert recorded_noise(image, 16383).std() == pytest.approx(image.std(), rel=0.08)


def test_clipped_pixels_have_no_noise() -> None:
    """Two thirds of the frame are clipped; on the rest noise is kept. A frame without noise gets none."""
    image = noisy_image(5.0)
    image[:100], image[-71:] = 0, 16383
    noise = recorded_noise(image, 16383)
    assert noise[102:-73].std() == pytest.approx(5, rel=0.06)
    assert not noise[:99].any()
    for level in (0, 700, 16383):
        image[:] = level
        image[20, 20] = 9000
        assert np.abs(recorded_noise(image, 16383)).max() < 1


def test_large_deviations_are_folded_without_a_jump() -> None:
    """Unchanged up to 7, back to -3.5, then to and fro: 14 becomes 0, 17.5 -3.5, 24.5 3.5, 28 0."""
    off = np.array([0, 3, 7, 8, 10.5, 14, 17.5, 21, 24.5, 28], np.float32)
    into = np.array([0, 3, 7, 6, 3.5, 0, -3.5, 0, 3.5, 0])
    np.testing.assert_allclose(folded(off, 7.0), into, atol=1e-6)
    np.testing.assert_allclose(folded(-off, 7.0), -into, atol=1e-6)
    fine = np.linspace(-100, 100, 20001)
    np.testing.assert_allclose(np.abs(np.diff(folded(fine, 7.0))), 0.01, atol=0.0101)


def preset_scene(preset: str, **keys: Any) -> Scenario:
    """Return a scene of uniform ground of 290 K, or of the given background, in two frames."""
    camera = {"preset": preset, "size": SIZE}
    ground = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.0}
    return Scenario.model_validate({"frames": 2, "camera": camera, "background": ground, **keys})


@pytest.mark.parametrize("preset", list(PRESETS))
def test_an_inserted_car_has_the_contrast_of_a_rendered_one(tmp_path: Path, preset: str) -> None:
    """320 K on ground of 290 K adds the same counts, within noise and rounding."""
    file = record(Rendering(preset_scene(preset)), tmp_path / "ground.mcap")
    camera = preset_scene(preset).camera
    path = {"kind": "straight", "start": (32.0, 24.0), "range_m": 0.1 / camera.geometry.ifov_rad}
    cars = [{"id": "car", "shape": {"kind": "car", "temperature_k": 320.0}, "path": path}]
    inserted = Rendering(preset_scene(preset, background=on(file), targets=cars))
    rendered = Rendering(preset_scene(preset, targets=cars))
    own = Rendering(preset_scene(preset)).frame(1).image.astype(float)
    (added, truth), (expected, expected_truth) = (
        (float((each.frame(1).image - own).sum()), next(each.truths(1, 2)).targets[0]) for each in (inserted, rendered)
    )
    sigma = max(camera.response().noise / camera.response().gain, 0.3)
    assert expected > 1000 * sigma
    assert added == pytest.approx(expected, rel=2e-3, abs=5 * sigma * (truth.box.w * truth.box.h) ** 0.5)
    assert truth.contrast_k == pytest.approx(expected_truth.contrast_k, abs=0.1)


def test_the_temperature_range_is_that_of_the_recording(tmp_path: Path) -> None:
    file = footage(tmp_path)
    for given, expected in (({}, (250.0, 330.0)), ({"range_k": (200.0, 500.0)}, (200.0, 500.0))):
        assert Recorded.model_validate({"file": str(file), **given}).range_k == expected


@pytest.mark.parametrize("preset", ["cooled_mwir", "cooled_lwir"])
def test_photon_counts_give_the_scene_temperature(tmp_path: Path, preset: str) -> None:
    """The recording holds the curve of the camera instead of a range; in another band it has no meaning."""
    file = record(Rendering(preset_scene(preset)), tmp_path / "ground.mcap")
    recording = open_recording(file)
    band = recording.camera.band
    assert recording.camera.range_k is None
    assert band is not None
    background = preset_scene(preset, background=on(file)).background
    assert isinstance(background, Recorded)
    mean = recording.frame(0).image.astype(np.float64).mean(keepdims=True)
    assert temperature(band, background.scale(band).light(mean)).item() == pytest.approx(290, abs=0.05)
    assert loads(dumps(preset_scene(preset, background=background))).background == background
    assert background.scale("mwir").root == 0
    given = Recorded.model_validate({"file": str(file), "range_k": (250.0, 330.0)})
    assert given.scale(band) == Scale.between(band, (250.0, 330.0), recording.bits)


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ("file: nowhere.mcap", "nowhere.mcap"),
        ("file: OWN, start: 9", "allowed: 0 to 4"),
        ("file: OWN, range_k: [300, 250]", "the lower temperature first"),
        ("file: OWN, digest: abc", "has changed"),
    ],
)
def test_invalid_recordings_are_one_line_with_a_place(tmp_path: Path, keys: str, reason: str) -> None:
    file = footage(tmp_path)
    text = f"camera: {{size: [64, 48], bits: 14}}\nbackground: {{kind: recording, {keys.replace('OWN', str(file))}}}\n"
    with pytest.raises(InputError, match=reason) as raised:
        loads(text, "scene.yaml")
    assert str(raised.value).startswith("scene.yaml:2:")
    assert "\n" not in str(raised.value)
    with pytest.raises(InputError, match=r"allowed: camera size: \[64, 48\], bits: 14"):
        loads(f"background: {{kind: recording, file: {file}}}\n")


def test_no_output_replaces_the_footage(tmp_path: Path, run: Run) -> None:
    file = footage(tmp_path)
    before, into = file.read_bytes(), Rendering(scene(on(file), targets=[TARGET]))
    assert into.needs == (file,)
    with pytest.raises(InputError, match=r"would replace .*own\.mcap, which this command needs"):
        record(into, file)
    (tmp_path / "into.yaml").write_text(dumps(into.scenario))
    assert run("render", "into.yaml", "-o", "own.mcap", "--frames", "2", cwd=tmp_path).returncode == 2
    assert file.read_bytes() == before


def labelled_footage(folder: Path) -> Path:
    """Return footage of four frames with a bird of 4 x 2 px that moves, and a stone with the id `hot`."""
    (folder / "clip").mkdir()
    for index in range(4):
        cv2.imwrite(str(folder / "clip" / f"{index}.png"), np.full(SIZE[::-1], 8000 + index, np.uint16))
    rows = [f"{index},{20 + 4 * index},23,4,2,bird,bird\n{index},5,40,3,3,hot,stone\n" for index in range(4)]
    (folder / "gt.csv").write_text("frame,x,y,w,h,id,cls\n" + "".join(rows))
    return import_frames(folder / "clip", folder / "own.mcap", truth=folder / "gt.csv", bits=14, rate_hz=30)


def test_footage_keeps_its_own_truth(tmp_path: Path) -> None:
    """Beside that of new targets, with another id where it is taken; in looped and held frames that of their frame."""
    file = labelled_footage(tmp_path)
    looped, held = (Rendering(scene(on(file, start=1, past_end=end), targets=[TARGET])) for end in ("loop", "hold"))
    for rendering, last in ((looped, (1 + 8) % 4), (held, 3)):
        for index, recorded in ((0, 1), (2, 3), (8, last)):
            truth = rendering.truth(index)
            assert [target.id for target in truth.targets] == ["hot", "bird", "footage-hot"]
            own = open_recording(file).truth(recorded)
            assert own is not None
            assert [target.box for target in truth.targets[1:]] == [target.box for target in own.targets]
            assert [target.cls for target in truth.targets[1:]] == ["bird", "stone"]
            assert truth.targets[2].accuracy_px == 1.0
        assert rendering.follow == "hot"
    assert Rendering(scene(on(file))).follow == "bird"
    read = open_recording(record(looped, tmp_path / "new.mcap"))
    assert read.targets == ("hot", "bird", "footage-hot")
    assert [target.id for target in next(read.truths()).targets] == ["hot", "bird", "footage-hot"]


def test_new_objects_hide_the_footage_s_targets(tmp_path: Path) -> None:
    """A bar over the left half of the bird's box hides half of it; behind nothing, its visibility stays unknown."""
    file = labelled_footage(tmp_path)
    bar = {"kind": "bar", "center_px": (19.5, 24.0), "size_px": (4.0, 30.0), "range_m": 300.0}
    plate = PLATE | {"shape": {"kind": "hot_spot", "size_m": (3.0, 3.0), "temperature_k": 320.0}}
    rendering = Rendering(scene(on(file), targets=[plate], occluders=[bar]))
    bird = rendering.truth(0).target("bird")
    assert bird is not None
    # The bird covers columns 20 to 23, from 19.5 to 23.5; the bar reaches from 17.5 to 21.5.
    assert (bird.box.left, bird.box.right) == (19.5, 23.5)
    assert bird.visible == pytest.approx(0.5, abs=0.01)
    assert bird.occluders == (rendering.scenario.occluders[0].name,)
    assert not bird.crossing
    later, target = (rendering.truth(3).target(name) for name in ("bird", "plate"))
    assert later is not None
    assert target is not None
    assert later.box.iou(target.box) > 0
    assert later.crossing
    assert target.crossing
    stone = rendering.truth(0).target("hot")
    assert stone is not None
    assert (stone.visible, stone.occluders) == (None, ())
