"""`irsim fit --display`: the AGC of a recording by what the camera showed; what cannot be told, and bad pictures."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.types import Image

SCENE = """\
frames: 24
camera: {{size: [96, 80], range_k: [280, 320], netd_mk: 60, agc: {agc}}}
background: {{kind: ground, spread_k: 2}}
"""
FIXED = "{kind: fixed, low: 2000, high: 9000}"


def counts(agc: str = FIXED) -> irsim.Source:
    return irsim.open_source(irsim.loads(SCENE.format(agc=agc)))


def imported(folder: Path, name: str, images: Iterable[Image], bits: int | None = None) -> Path:
    pictures = folder / name
    pictures.mkdir()
    for k, image in enumerate(images):
        cv2.imwrite(str(pictures / f"{k:04}.png"), image)
    path: Path = irsim.import_frames(pictures, folder / f"{name}.mcap", bits=bits)
    return path


@pytest.fixture
def footage(tmp_path: Path) -> tuple[Path, Path]:
    """A user's own: counts of 14 bits of which nobody says how they are shown, and what was shown."""
    frames, shown = ([frame.image for frame in counts().frames(input)] for input in ("counts", "display"))
    return imported(tmp_path, "mine", frames, 14), imported(tmp_path, "shown", shown)


def test_the_command_writes_the_display_with_its_tolerances(footage: tuple[Path, Path], tmp_path: Path) -> None:
    mine, shown = footage
    camera = tmp_path / "camera.yaml"
    done = CliRunner().invoke(app, ["fit", str(mine), "--display", str(shown), "-o", str(camera)])
    assert done.exit_code == 0, done.output
    text = camera.read_text()
    assert "each number may be turned by itself before the pictures tell.\n" in text
    assert "  agc:  # fitted to 12 pictures, from which its own differ by 0 greys rms\n    kind: fixed\n" in text
    assert "    low: 2000  # 19" in text
    assert "display" not in done.stderr
    assert irsim.load(camera).camera.agc == counts().agc
    said = {label: text.strip() for label, _, text in (line.partition(" ") for line in done.stdout.splitlines())}
    assert said["display"] == "fixed, 0 greys rms"
    assert re.fullmatch(r"[\d.]+ \([\d.]+ to [\d.]+\) counts in time, of each pixel", said["noise"])
    assert said["bad"].startswith("dead 0 (0 to 0.000")
    assert said["psf"].endswith(" px, taken: no point is seen")
    told = json.loads(CliRunner().invoke(app, ["fit", str(mine), "--display", str(shown), "--json"]).stdout)["display"]
    assert told["kind"] == "fixed"
    assert told["agc"] == {"kind": "fixed", "low": 2000, "high": 9000}
    assert (told["rms_grey"], told["frames"]) == (0, 12)
    value, low, high = told["tolerances"]["high"]
    assert low <= value == 9000 <= high


def test_without_pictures_it_says_where_the_display_comes_from(footage: tuple[Path, Path]) -> None:
    mine, shown = footage
    unknown = irsim.fit(mine)
    assert unknown.scenario.camera.agc.kind == "linear"
    assert unknown.display is None
    assert any("cannot be told without pictures" in note and "display=PICTURES: a" in note for note in unknown.notes)
    told = CliRunner().invoke(app, ["fit", str(mine)]).stdout
    assert "--display PICTURES: a" in " ".join(told.split())
    assert "display=" not in told
    said = irsim.fit(counts())
    assert "# as the recording says" in said.text
    assert not [note for note in said.notes if "display" in note]
    picture = irsim.fit(shown)
    assert picture.scenario.camera.agc.kind == "none"
    assert "8 bits: the counts are shown as they are" in picture.notes


def test_what_was_seen_wins_over_what_the_recording_says(footage: tuple[Path, Path]) -> None:
    found = irsim.fit(counts("{kind: linear}"), display=footage[1])
    assert found.display is not None
    assert found.scenario.camera.agc == counts().agc


def test_pictures_that_tell_nothing_are_a_note(tmp_path: Path) -> None:
    source = counts()
    still = imported(tmp_path, "still", [source.frame(0, "display").image] * len(source))
    grey = imported(tmp_path, "grey", [np.full((80, 96), 90, np.uint8)] * len(source))
    inverted = imported(tmp_path, "inverted", [255 - frame.image for frame in source.frames("display")])
    for shown, why in (
        (inverted, "the pictures are inverted, black-hot"),
        (still, "the pictures stand still while the counts change"),
        (grey, "every picture has one grey"),
    ):
        found = irsim.fit(source, display=shown)
        assert found.display is None
        assert any(note.startswith(f"the display cannot be told: {why}") for note in found.notes), found.notes
        assert found.scenario.camera.agc == source.agc


@pytest.mark.slow
def test_a_display_of_no_kind_of_ours_is_said_to_be_none(tmp_path: Path) -> None:
    """Brightness that turns around is no curve that any kind has."""
    source = counts()
    turned = [np.minimum(abs(frame.image - np.median(frame.image)) * 8, 255) for frame in source.frames("display")]
    found = irsim.fit(source, display=imported(tmp_path, "turned", [image.astype(np.uint8) for image in turned]))
    assert found.display is not None
    assert found.display.rms_grey > 8
    assert any(note.startswith("no kind of AGC known here explains the pictures") for note in found.notes)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda folder: imported(folder, "p", [np.zeros((80, 64), np.uint8)] * 24), "64x80 px, but mine has 96x80"),
        (
            lambda folder: imported(folder, "p", [np.zeros((80, 96), np.uint8)] * 20),
            "20 pictures, but mine has 24 fram",
        ),
        (lambda folder: imported(folder, "p", [np.zeros((80, 96), np.uint16)] * 24, 12), "12 bits deep; allowed: what"),
        (lambda folder: folder / "mine.mcap", "14 bits deep; allowed: what"),
        (lambda folder: folder / "mine", "16 bits deep; allowed: what"),
        (lambda folder: folder, "holds no .png or .tif"),
        (lambda folder: folder / "none.mcap", "no such file"),
    ],
)
def test_bad_pictures_are_one_line(footage: tuple[Path, Path], make: object, what: str, tmp_path: Path) -> None:
    assert callable(make)
    done = CliRunner().invoke(app, ["fit", str(footage[0]), "--display", str(make(tmp_path))])
    assert isinstance(done.exception, InputError)
    assert what in str(done.exception)
    assert "\n" not in str(done.exception)


@pytest.mark.parametrize("name", ["shown", "shown.avi"])
def test_a_folder_and_a_video_are_read_as_import_does(name: str, footage: tuple[Path, Path], tmp_path: Path) -> None:
    """FFV1 keeps each grey as it is; it states another rate than the recording has."""
    mine, shown = footage
    video = cv2.VideoWriter(str(tmp_path / "shown.avi"), cv2.VideoWriter.fourcc(*"FFV1"), 25, (96, 80), isColor=False)
    for frame in irsim.open_recording(shown).frames():
        video.write(frame.image)
    video.release()
    found = irsim.fit(mine, display=tmp_path / name)
    assert found.display is not None
    assert found.display.rms_grey == 0
    assert found.scenario.camera.agc == counts().agc
    assert not [note for note in found.notes if "Hz assumed" in note]


def test_of_colours_it_says_that_they_were_made_grey(footage: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "warm").mkdir()
    for file in (tmp_path / "shown").iterdir():
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        assert grey is not None
        colours = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
        colours[..., 0] = np.minimum(grey, 254) + 1  # blue has 0.114 of the luma: the grey stays
        cv2.imwrite(str(tmp_path / "warm" / file.name), colours)
    found = irsim.fit(footage[0], display=tmp_path / "warm")
    assert any(note.startswith("24 of 24 pictures had colours: made grey") for note in found.notes)


@pytest.mark.parametrize("name", ["shown.mcap", "shown", "copy.mcap"])
def test_pictures_that_are_the_source_itself_are_refused(name: str, footage: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "copy.mcap").write_bytes(footage[1].read_bytes())
    done = CliRunner().invoke(app, ["fit", str(footage[1]), "--display", str(tmp_path / name)])
    assert isinstance(done.exception, InputError)
    assert "its pictures are the frames of shown themselves, which tell of no display; allowed" in str(done.exception)


def test_frames_before_the_first_that_is_looked_at_run_a_slow_gain_in(tmp_path: Path) -> None:
    """Frame 12's picture has a memory of those before it, of which frames 12 to 23 tell nothing."""
    slow = "{kind: linear, tails: [0.01, 0.01], time_constant_frames: 4}"
    pan = SCENE.replace("netd_mk: 60", "netd_mk: 60, motion: [{{kind: pan, azimuth_deg_s: 4}}]")
    source = irsim.open_source(irsim.loads(pan.format(agc=slow)))
    shown = imported(tmp_path, "shown", [frame.image for frame in source.frames("display")])
    found = irsim.fit(source, display=shown, start=12)
    assert found.display is not None
    assert found.display.rms_grey < 0.05
    assert found.display.frames == 12
    assert found.display.agc.memory > 0


def test_the_pictures_are_not_written_over(footage: tuple[Path, Path]) -> None:
    mine, shown = footage
    done = CliRunner().invoke(app, ["fit", str(mine), "--display", str(shown), "-o", str(shown)])
    assert isinstance(done.exception, InputError)
    assert "would replace" in str(done.exception)
