"""irsim export: data sets from the command line, and labels of them imported again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Run

import irsim


def test_a_data_set_and_its_labels_back(run: Run, folder: Path) -> None:
    words = ("export", "scene.yaml", "frames=4", "--format", "coco", "--seeds", "2", "--split", ".5,.5", "-o", "set")
    done = run(*words, cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "set: the card is set/card.json\n", "")
    card = json.loads((folder / "set" / "card.json").read_text())
    assert card["command"] == f"irsim {' '.join(words)}"
    assert [clip["frames"] for clip in card["whole"]] == [4, 4]
    done = run(
        *("import", "set/images/train", "--truth", "set/annotations/train.json", "--truth-format", "coco"),
        *("--rate", "30", "-o", "back.mcap"),
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    assert "irsim: note: train.json is read as coco: JSON with images and annotations" in done.stderr.splitlines()
    assert irsim.open_recording(folder / "back.mcap").targets == ("jet",)


WRONG = [
    (
        ("--format", "coc"),
        "irsim: --format 'coc': allowed: coco, yolo, mot, vot, anti-uav, sirst, png, npz, mp4, rrd",
    ),
    (("--format", "coco", "--split", "a"), "irsim: --split a: allowed: shares that add up to 1, as .8,.1,.1"),
    (("--format", "coco", "--split", ".5,.5"), "irsim: --split 0.5,0.5: 1 clip for 2 splits, as the frames of a clip"),
    (("--format", "coco", "--min-visible", "2"), "irsim: --min-visible 2.0: allowed: a number from 0 to 1"),
    (("--format", "mp4", "--input", "counts"), "irsim: --input counts: mp4 holds 8-bit pictures; allowed: display"),
    (("--format", "coco", "camera.netd=3"), "irsim: override camera.netd: unknown key"),
]


@pytest.mark.parametrize(("options", "message"), WRONG)
def test_wrong_options_are_one_line(options: tuple[str, ...], message: str, run: Run, folder: Path) -> None:
    done = run("export", "scene.yaml", *options, "-o", "set", cwd=folder)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert done.stderr.startswith(message)
    assert not (folder / "set").exists()


def test_a_missing_package_is_named(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    done = run("export", "scene.yaml", "--format", "rrd", "-o", "set", cwd=folder)
    assert done.returncode == 2
    assert done.stderr == "irsim: --format rrd: needs rerun: pip install 'irtrack[rerun]'\n"


def test_ctrl_c_leaves_a_card(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from irsim.recording.formats.folder import DatasetFolder

    write = DatasetFolder.write

    def interrupted(self: DatasetFolder, name: str, data: bytes) -> None:
        if name.startswith("scene-s1/000002"):
            raise KeyboardInterrupt
        write(self, name, data)

    monkeypatch.setattr(DatasetFolder, "write", interrupted)
    done = run("export", "scene.yaml", "--format", "png", "--seeds", "2", "-o", "set", cwd=folder)
    assert done.returncode == 130
    assert done.stderr == "irsim: stopped; set/card.json lists the clips that are whole\n"
    assert json.loads((folder / "set" / "card.json").read_text())["missing"] == ["scene-s1"]
