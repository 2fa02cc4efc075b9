"""Real clips beside rendered ones: one law is not told apart, others are; wrong folders are one line."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from typer.testing import CliRunner

from irsim.calibration import discriminator, realism_against
from irsim.calibration.discriminator import discriminate, floor, nearest_distance
from irsim.calibration.patches import BURST, SIDE_PX, burst_starts, cut_patches, source_patches
from irsim.calibration.real_clips import burnt_in_text, read_clips
from irsim.calibration.selection import Region
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.importers import import_frames
from irsim.types import Floats

TREES = 8
"""Trees of a classifier in these tests, for speed."""
Frames = npt.NDArray[np.uint8]
ROWS, COLUMNS, LENGTH = 96, 112, 12
PLACES = 6


def clip(seed: int, slope: float = 3.0, noise: float = 2.0) -> Frames:
    """Return a still power-law field f^-slope with white noise in time, (LENGTH, ROWS, COLUMNS)."""
    rng = np.random.default_rng(seed)
    radius = np.hypot.outer(np.fft.fftfreq(128), np.fft.rfftfreq(128))
    radius[0, 0] = np.inf
    field = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(128, 128))) * radius ** (-slope / 2))[:ROWS, :COLUMNS]
    still = 120 + 25 * (field - field.mean()) / field.std()
    frames: Frames = np.clip(np.rint(still + rng.normal(0, noise, (LENGTH, ROWS, COLUMNS))), 0, 255).astype(np.uint8)
    return frames


def write_folder(folder: Path, clips: dict[str, Frames], background: str = "cloud") -> Path:
    lines = ["clip,place,class,x0,y0,x1,y1"]
    for name, frames in clips.items():
        (folder / name).mkdir(parents=True)
        np.save(folder / name / "frames.npy", frames)
        lines.append(f"{name},{name},{background},0,0,{frames.shape[2]},{frames.shape[1]}")
    (folder / "places.csv").write_text("\n".join(lines) + "\n")
    return folder


@pytest.fixture(autouse=True)
def _few_trees(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(discriminator, "TREES", TREES)
    monkeypatch.setattr(realism_against, "_FAMILY_HALVINGS", 1)


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(tmp_path_factory.mktemp("real"), {f"c{k}": clip(k) for k in range(PLACES)})


def groups(seed: int, count: int, shift: float = 0.0) -> list[Floats]:
    """Return features of groups, which differ from each other by half of the spread inside a group."""
    rng = np.random.default_rng(seed)
    return [rng.normal(shift + rng.normal(0, 0.5, 6), 1, (24, 6)) for _ in range(count)]


def test_groups_of_one_law_are_not_told_apart() -> None:
    pytest.importorskip("sklearn")
    found = discriminate(groups(1, 8), groups(2, 8), "same")
    assert found.low < 0.5 < found.high
    assert 0.3 < found.value < 0.7
    least = floor(groups(1, 8), "same")
    assert least.low < 0.5 < least.high


@pytest.mark.slow
def test_intervals_cover_one_half_for_one_law() -> None:
    """Of 40 planted pairs of one law, whose groups differ, 95 % intervals cover .5 in 33 or more."""
    pytest.importorskip("sklearn")
    found = [discriminate(groups(2 * k, 6), groups(2 * k + 1, 6), f"law {k}") for k in range(40)]
    assert sum(each.low <= 0.5 <= each.high for each in found) >= 33
    assert np.mean([each.value for each in found]) == pytest.approx(0.5, abs=0.06)


def test_groups_of_other_laws_are_told_apart() -> None:
    pytest.importorskip("sklearn")
    found = discriminate(groups(1, 8), groups(2, 8, 3.0), "other")
    assert found.value > 0.97
    assert found.low > 0.9


def test_nearest_distance_is_one_within_a_law() -> None:
    assert nearest_distance(groups(1, 40), groups(2, 40)) == pytest.approx(1, abs=0.25)
    assert nearest_distance(groups(1, 40), groups(2, 40, 3.0)) > 3


def test_command_tells_other_laws_from_real_clips(real: Path, tmp_path: Path) -> None:
    """Planted: recordings of the law of the clips, and of a shallower spectrum with more noise."""
    pytest.importorskip("sklearn")
    found = {}
    for name, law in {"same": {}, "other": {"slope": 1.5, "noise": 4.0}}.items():
        recordings = []
        for k in range(4):
            np.save(tmp_path / "frames.npy", clip(100 + k, **law))
            recordings.append(str(import_frames(tmp_path / "frames.npy", tmp_path / f"{name}{k}.mcap")))
        page = tmp_path / f"{name}.html"
        arguments = ["realism", *recordings, "--like", "cloud", "--against", str(real), "--json", "-o", str(page)]
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code == 0, done.output
        found[name] = json.loads(done.stdout)["classes"]["cloud"]
        assert page.read_text().count("data:image/png") == 2
    same, other = found["same"], found["other"]
    assert same["auc"][1] < 0.5 < same["auc"][2]
    assert other["auc"][0] > 0.97
    assert (same["places"], same["scenes"]) == (PLACES, 4)
    assert same["floor"] == other["floor"]
    assert other["floor"][1] < 0.5 < other["floor"][2]
    assert other["ceiling"][0] > 0.97
    assert min(other["families"][name][0] for name in ("spectrum", "wavelet", "time")) > 0.9
    assert same["distance"] < other["distance"]


def test_real_patches_are_not_altered(real: Path) -> None:
    for group in read_clips(real)["cloud"]:
        frames = np.load(real / group.name / "frames.npy")
        bursts = [frames[start : start + BURST] for start in burst_starts(len(frames))]
        every = {cut.tobytes() for burst in bursts for cut in cut_patches(burst, Region(0, 0, COLUMNS, ROWS), ())}
        assert len(group.patches) == 64
        assert all(patch.tobytes() in every for patch in group.patches)


def test_patches_avoid_targets(real: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(real, tmp_path / "real")
    rows = "\n".join(f"{k},40,10,8,60,0,BIRD" for k in range(LENGTH))
    (folder / "c0" / "gt.csv").write_text(f"frame,x,y,w,h,id,cls\n{rows}\n")
    marked = np.load(folder / "c0" / "frames.npy")
    marked[:, 10:70, 40:48] = 255
    np.save(folder / "c0" / "frames.npy", marked)
    (group,) = [each for each in read_clips(folder)["cloud"] if each.name == "c0"]
    assert 0 < len(group.patches) < 64
    assert not (group.patches == 255).all(axis=(1, 2)).any()


@pytest.mark.parametrize("grey", [255, 0])
def test_burnt_in_text_is_found(grey: int) -> None:
    frames = clip(3)
    assert burnt_in_text(frames) is None
    for frame in frames:
        cv2.putText(frame, "REC 12:45", (8, 30), cv2.FONT_HERSHEY_SIMPLEX, 0.4, grey, 1)
    at = burnt_in_text(frames)
    assert at is not None
    assert 5 <= at[0] <= 70
    assert 15 <= at[1] <= 30


def large(folder: Path) -> None:
    np.save(folder / "c1" / "frames.npy", np.tile(clip(1), (1, 2, 1)))


def coloured(folder: Path) -> None:
    (folder / "c1" / "frames.npy").unlink()
    picture = np.repeat(clip(1)[0][..., np.newaxis], 3, axis=2)
    picture[5:15, 5:60] = (0, 200, 255)
    for k in range(3):
        cv2.imwrite(str(folder / "c1" / f"{k}.png"), picture)


def lettered(folder: Path) -> None:
    frames = clip(1)
    for frame in frames:
        cv2.putText(frame, "REC 12:45", (8, 30), cv2.FONT_HERSHEY_SIMPLEX, 0.4, 255, 1)
    np.save(folder / "c1" / "frames.npy", frames)


def deep(folder: Path) -> None:
    np.save(folder / "c1" / "frames.npy", clip(1).astype(np.uint16))


def outside(folder: Path) -> None:
    text = (folder / "places.csv").read_text()
    (folder / "places.csv").write_text(text.replace("c1,c1,cloud,0,0,112", "c1,c1,cloud,0,0,113"))


def small_region(folder: Path) -> None:
    text = (folder / "places.csv").read_text()
    (folder / "places.csv").write_text(text.replace("c1,c1,cloud,0,0,112,96", "c1,c1,cloud,0,0,40,96"))


def no_table(folder: Path) -> None:
    (folder / "places.csv").unlink()


def no_clip(folder: Path) -> None:
    shutil.rmtree(folder / "c1")


def short(folder: Path) -> None:
    np.save(folder / "c1" / "frames.npy", clip(1)[:2])


BAD: dict[Callable[[Path], Any], str] = {
    large: "c1 is 112x192 px and c0 112x96; allowed: clips of one size",
    coloured: "0.png: has colours, as of an overlay or a false-colour palette; allowed: grey pictures",
    lettered: "c1 has burnt-in text at ",
    deep: "has 16 bits; allowed: 8 bits",
    outside: "places.csv:3: does not fit; allowed: a region inside 112x96 px",
    small_region: "places.csv:3: c1,c1,cloud,0,0,40,96: allowed: names, and a region",
    no_table: "holds no places.csv; allowed: ",
    no_clip: "holds no clip 'c1'; allowed: c1.mcap, or ",
    short: "has 2 frames; allowed: at least 3",
}


@pytest.mark.parametrize("fault", BAD, ids=lambda fault: fault.__name__)
def test_a_wrong_folder_is_one_line(real: Path, tmp_path: Path, fault: Callable[[Path], Any]) -> None:
    folder = shutil.copytree(real, tmp_path / "real")
    fault(folder)
    with pytest.raises(InputError) as error:
        read_clips(folder)
    assert BAD[fault] in str(error.value)
    assert "\n" not in str(error.value)


@pytest.fixture
def recording(tmp_path: Path) -> str:
    np.save(tmp_path / "frames.npy", clip(7))
    return str(import_frames(tmp_path / "frames.npy", tmp_path / "clip.mcap"))


CALLS = {
    "few": (["--like", "cloud"], "cloud: too few places: 3; allowed: at least 4"),
    "few of a folder": (["FOLDER"], "cloud: too few places: 3; allowed: at least 4"),
    "no class": ([], "states no class of background; allowed: --like CLASS"),
    "other class": (["--like", "sea"], "class 'sea': there are no real clips of it; allowed: cloud"),
    "camera": (["--camera", "uncooled"], "--camera: compares with fixed ranges; allowed without --against only"),
    "page": (["--like", "cloud", "-o", "page.txt"], "page.txt"),
    "region": (["--like", "cloud", "--region", "0,0,40,96"], "40x96 px hold no patch; allowed: at least 48x48"),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_wrong_call_is_one_line(call: str, recording: str, tmp_path: Path) -> None:
    pytest.importorskip("sklearn")
    folder = write_folder(tmp_path / "few", {f"c{k}": clip(k) for k in range(3)})
    options, expected = CALLS[call]
    sources = [str(folder)] if options == ["FOLDER"] else [recording, recording, *options]
    done = CliRunner().invoke(app, ["realism", *sources, "--against", str(folder)])
    assert done.exit_code != 0
    assert expected in (done.output or str(done.exception)) + str(done.exception)


def test_a_missing_library_is_one_line(recording: str, real: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sklearn.ensemble", None)
    done = CliRunner().invoke(app, ["realism", recording, "--like", "cloud", "--against", str(real)])
    assert "a comparison with real clips needs scikit-learn: pip install 'irtrack[learn]'" in done.output + str(
        done.exception
    )


def test_patches_of_a_recording_are_of_its_display(recording: str) -> None:
    group = source_patches(open_recording(Path(recording)), "clip")
    assert group.patches.shape[1:] == (BURST, SIDE_PX, SIDE_PX)
