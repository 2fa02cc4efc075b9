"""Masks against truth, and as files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import irsim
from irsim.camera.camera import Camera
from irsim.cli.app import app
from irsim.render.masks import Mask, write_masks
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.targets.target import Target


@pytest.mark.parametrize(("name", "frames"), [("traffic", [60]), ("decoys", [60])])
def test_visible_fractions_in_truth_are_those_of_the_masks(name: str, frames: list[int]) -> None:
    scenario = irsim.load(name)
    rendering = Rendering(scenario)
    for index in frames:
        (truth,) = rendering.truths(index, index + 1)
        (found,) = irsim.masks(scenario, index, index + 1)
        assert set(found) == {target.id for target in truth.targets}
        for target in truth.targets:
            mask = found[target.id]
            assert mask.visible.sum() / mask.area == pytest.approx(target.visible, abs=1e-7)
            assert np.all(mask.visible <= mask.whole + 1e-12)


def scene(kind: str = "fighter") -> Scenario:
    path = {"kind": "straight", "start": (60.0, 50.0), "speed": 1.0, "range_m": 800.0}
    kinds: dict[str, dict[str, object]] = {"hot_spot": {"size_m": (8.0, 5.0)}, "point": {"area_m2": 20.0}}
    keys = kinds.get(kind, {})
    return Scenario.model_validate(
        {
            "frames": 3,
            "camera": {"size": (120, 100), "psf_px": 0.4},
            "background": {"kind": "sky"},
            "targets": [{"id": "one", "shape": {"kind": kind, **keys}, "path": path}],
            "occluders": [{"kind": "bar", "center_px": (50.0, 50.0), "size_px": (20.0, 80.0), "range_m": 300.0}],
        }
    )


@pytest.mark.parametrize("kind", ["fighter", "hot_spot", "point"])
def test_a_bar_cuts_the_mask_at_its_edge(kind: str) -> None:
    (found,) = irsim.masks(scene(kind), 0, 1)
    mask = found["one"]
    assert mask.whole.sum() == pytest.approx(mask.area, rel=1e-6)
    # The bar covers columns 40 to 59 and the near half of 60: what is left of there is hidden.
    assert mask.visible[:, 40:60].max() < 0.01
    np.testing.assert_allclose(mask.visible[:, 62:], mask.whole[:, 62:], atol=1e-9)


def test_files_hold_the_masks(tmp_path: Path) -> None:
    scenario, folder = scene(), tmp_path / "masks"
    paths = [path for each in write_masks(scenario, folder, 1, 3) for path in each]
    assert [path.name for path in paths] == [
        f"{frame:06}_one_{what}.png" for frame in (1, 2) for what in ("whole", "visible")
    ]
    (mask,) = (found["one"] for found in irsim.masks(scenario, 2, 3))
    read = cv2.imread(str(folder / "000002_one_visible.png"), cv2.IMREAD_UNCHANGED)
    assert read is not None
    assert read.dtype == np.uint8
    np.testing.assert_allclose(read / 255, mask.visible, atol=0.5 / 255 + 1e-9)


FAULTS: list[dict[str, object]] = [{"kind": "drop", "frames": [1]}, {"kind": "duplicate", "frames": [3]}]
"""Of frames 0 .. 4 arrive 0, 2, 3, 3, 4."""


def moving(faults: list[dict[str, object]]) -> Scenario:
    path = {"kind": "straight", "start": (20.0, 50.0), "speed": 15.0, "range_m": 800.0}
    target = {"id": "one", "shape": {"kind": "hot_spot", "size_m": (4.0, 4.0)}, "path": path}
    return scene().model_copy(
        update={
            "frames": 5,
            "occluders": (),
            "camera": Camera.model_validate({"size": (120, 100), "faults": faults}),
            "targets": (Target.model_validate(target),),
        }
    )


def places(masks: Iterable[dict[str, Mask]]) -> list[float]:
    """x of the target's centroid in each mask, px."""
    covers = [found["one"].whole for found in masks]
    return [float((np.arange(cover.shape[1]) * cover).sum() / cover.sum()) for cover in covers]


def test_masks_belong_to_the_frames_that_arrive() -> None:
    scenario = moving(FAULTS)
    xs = [truth.targets[0].center[0] for truth in Rendering(scenario).truths()]
    assert np.diff(xs) == pytest.approx([30, 15, 0, 15])
    assert places(irsim.masks(scenario)) == pytest.approx(xs, abs=1e-3)
    assert places(irsim.masks(scenario, 1, 3)) == pytest.approx(xs[1:3], abs=1e-3)


def test_masks_of_a_recording_have_its_frame_numbers(tmp_path: Path) -> None:
    """It begins at the third frame that arrives."""
    made = irsim.record(Rendering(moving(FAULTS)), tmp_path / "late.mcap", start=2)
    recording = irsim.open_recording(made)
    folder = tmp_path / "masks"
    assert CliRunner().invoke(app, ["masks", str(made), "-o", str(folder)]).exit_code == 0
    assert sorted(path.name for path in folder.glob("*_whole.png")) == [f"{k:06}_one_whole.png" for k in range(3)]
    for truth in recording.truths():
        cover = cv2.imread(str(folder / f"{truth.index:06}_one_whole.png"), cv2.IMREAD_UNCHANGED)
        assert cover is not None
        assert (np.arange(120) * cover).sum() / cover.sum() == pytest.approx(truth.targets[0].center[0], abs=0.05)
    part = tmp_path / "part"
    assert CliRunner().invoke(app, ["masks", str(made), "-o", str(part), "--frames", "1:2"]).exit_code == 0
    assert (part / "000001_one_whole.png").read_bytes() == (folder / "000001_one_whole.png").read_bytes()
    assert len(list(part.iterdir())) == 2


def written(folder: Path, scenario: Scenario, start: int, stop: int, target: str | None = None) -> list[str]:
    """What lies in the folder after masks were written."""
    list(write_masks(scenario, folder, start, stop, target))
    return sorted(path.name for path in folder.iterdir())


def test_older_masks_are_replaced_or_refused(tmp_path: Path) -> None:
    """Those of the same frames are replaced, also by nothing; where others would stay, nothing is touched."""
    folder = tmp_path / "masks"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    of_three = written(folder, scene(), 0, 3)
    assert len(of_three) == 7
    absent = scene().targets[0].model_copy(update={"absent": ((1, 1),)})
    left = written(folder, scene().model_copy(update={"targets": (absent,)}), 0, 3)
    assert left == [name for name in of_three if not name.startswith("000001")]
    before = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    for start, stop, names in ((0, 2, {}), (1, 3, {}), (0, 3, {"id": "two"})):
        target = scene().targets[0].model_copy(update=names)
        with pytest.raises(
            irsim.InputError, match=r"masks: holds masks of another call .*_one_visible\.png and .*allowed"
        ):
            written(folder, scene().model_copy(update={"targets": (target,)}), start, stop)
    assert {path: path.stat().st_mtime_ns for path in folder.iterdir()} == before


def test_a_folder_of_other_pictures_is_refused(tmp_path: Path) -> None:
    (tmp_path / "0000.png").write_bytes(b"mine")
    with pytest.raises(irsim.InputError, match=r"holds pictures that are no masks, 0000\.png; allowed: a new or empty"):
        written(tmp_path, scene(), 0, 1)
    assert len(list(tmp_path.iterdir())) == 1


def test_wrong_arguments_of_masks_are_input_errors(tmp_path: Path) -> None:
    with pytest.raises(irsim.InputError, match="target 'two': there is no such target; allowed: one"):
        next(write_masks(scene(), tmp_path, 0, 1, "two"))
    (tmp_path / "file").write_text("")
    with pytest.raises(irsim.InputError, match="file: is no folder; allowed: the name of a folder"):
        next(write_masks(scene(), tmp_path / "file", 0, 1))
    with pytest.raises(irsim.InputError, match="start"):
        next(irsim.masks(scene(), -1))
