"""Files named in scenarios: relative to the scenario, with errors at their place."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from mesh_files import BOX

import irsim
from irsim.cli.figures import contact_sheet
from irsim.config.paths import is_there
from irsim.errors import InputError
from irsim.lint.warnings import warnings
from irsim.recording import open_recording

GROUND = "frames: 2\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
TARGET = "targets:\n  - {id: box, path: {kind: straight, start: [9, 9]}, shape: {kind: mesh, length_m: 4, KEYS}}\n"
SCENE = (GROUND + TARGET).replace("KEYS", "file: box.obj")


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario in a folder of its own with its mesh; the working directory is another folder."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    (tmp_path / "scenes" / "box.obj").write_text(BOX)
    path = tmp_path / "scenes" / "scene.yaml"
    path.write_text(SCENE)
    return path


def mesh_of(scenario: irsim.Scenario) -> str:
    return str(scenario.files[-1])


def test_a_mesh_is_relative_to_the_scenario(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that exists only relative to the working directory is that file; so is a name in an override."""
    Path("own.obj").write_text(BOX)
    assert mesh_of(irsim.load(scene, ["targets.box.shape.file=own.obj"])) == str(Path("own.obj").absolute())
    Path("own.obj").rename("box.obj")
    assert mesh_of(irsim.load(scene)) == str(scene.with_name("box.obj"))
    assert irsim.load("../scenes/scene.yaml") == irsim.load(scene)
    scene.with_name("box.obj").unlink()
    assert mesh_of(irsim.load(scene)) == str(Path("box.obj").absolute())
    Path("box.obj").unlink()
    with pytest.raises(InputError, match=r"scene\.yaml:5:\d+: targets\.box\.shape\.file: \S*scenes/box\.obj: there is"):
        irsim.load(scene)


def test_a_recorded_background_is_relative(scene: Path) -> None:
    irsim.record(irsim.Rendering(irsim.load(scene)), scene.with_name("real.mcap"))
    other = scene.with_name("other.yaml")
    other.write_text(SCENE.replace("{kind: ground}", "{kind: recording, file: real.mcap}"))
    scenario = irsim.load(other)
    assert scenario.files[0] == scene.with_name("real.mcap")
    recording = irsim.open_recording(irsim.record(irsim.Rendering(scenario), scene.with_name("again.mcap")))
    assert recording.scenario_text is not None
    again = irsim.loads(recording.scenario_text, trusted=False)
    assert (again, again.hash) == (scenario, scenario.hash)


def test_files_in_tables_are_relative(scene: Path) -> None:
    scene.with_name("other.obj").write_text(BOX)
    scene.write_text(f"{SCENE}severities:\n  targets.box.shape.file: [box.obj, other.obj]\n")
    assert mesh_of(irsim.load(scene, ["severity=1"])) == str(scene.with_name("other.obj"))
    other = "{kind: mesh, file: other.obj, length_m: 2}"
    scene.write_text(f"{SCENE}vary:\n  targets.box.shape: {{kind: choice, values: [{other}]}}\n")
    assert warnings(scene) == []
    (drawn,) = irsim.sample(irsim.load(scene), 1)
    assert mesh_of(drawn) == str(scene.with_name("other.obj"))


FILES = {"background": "own.mcap", "targets.box.shape": "box.obj"}
TEXTS = {"background": GROUND.replace("kind: ground", "kind: recording, KEYS"), "targets.box.shape": GROUND + TARGET}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with files to name."""
    irsim.record(irsim.Rendering(irsim.loads(GROUND)), tmp_path / FILES["background"])
    (tmp_path / FILES["targets.box.shape"]).write_text(BOX)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def error_of(text: str, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        irsim.loads(text, "f.yaml", overrides)
    (line,) = str(caught.value).splitlines()
    return line


@pytest.mark.parametrize("place", TEXTS)
def test_a_wrong_file_is_one_line_with_its_place(folder: Path, place: str) -> None:
    device = f"device{Path(FILES[place]).suffix}"
    (folder / device).symlink_to(os.devnull)
    for keys, line in {
        'file: "a\\0b"': "file: FOLDER/a\\x00b: no file can have this name; allowed: no zero bytes, ",
        f"file: {'a' * 300}": f"file: FOLDER/{'a' * 300}: cannot be read: File name too long",
        'file: ""': "file: the name is empty; allowed: the name of a file",
        "file: FILE, digest: 0": "digest: expected text, not 0; allowed: text",
        'file: FILE, digest: "5"': "digest: FOLDER/FILE has changed: its digest is ",
        f"file: {device}": f"file: FOLDER/{device}: is no regular file; allowed: ",
    }.items():
        text = TEXTS[place].replace("KEYS", keys).replace("FILE", FILES[place])
        assert f": {place}.{line.replace('FOLDER', str(folder)).replace('FILE', FILES[place])}" in error_of(text)


@pytest.mark.parametrize("place", TEXTS)
def test_a_missing_file_suggests_an_override(folder: Path, place: str) -> None:
    text, gone = TEXTS[place].replace("KEYS", "file: GONE"), f"gone{Path(FILES[place]).suffix}"
    problem = f"{place}.file: {folder}/{gone}: there is no such file; allowed: an existing file"
    line = error_of(text.replace("GONE", gone))
    assert line.endswith(f": {problem}; {place}.file=PATH selects another file")
    assert irsim.loads(text.replace("GONE", gone), "f.yaml", [f"{place}.file={FILES[place]}"])
    assert error_of(text.replace("GONE", FILES[place]), f"{place}.file={gone}") == f"override {problem}"


def test_an_impossible_name_does_not_exist() -> None:
    for name in ("a\0b", "a" * 300):
        assert not is_there(name)
        with pytest.raises(InputError, match=r"^a.*: (no file can have this name|cannot be read): "):
            open_recording(name)


def test_a_picture_replaces_no_file_of_the_scene(folder: Path) -> None:
    """Nor through a link."""
    read, link = folder / "box.obj", folder / "x.png"
    link.symlink_to(read)
    with pytest.raises(InputError, match=f"would replace {read}, which this command needs; allowed: another name"):
        contact_sheet(irsim.Rendering(irsim.loads(SCENE)), link)
    assert read.read_text() == BOX


def test_a_shells_pipe_is_read_repeatedly() -> None:
    read, write = os.pipe()
    try:
        os.write(write, b"frames: 3\nbackground: {kind: ground}\n")
        os.close(write)
        for _ in range(2):
            assert irsim.open_source(f"/dev/fd/{read}", ["frames=2"]).has_truth
    finally:
        os.close(read)


def test_an_endless_pipe_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("irsim.config.paths.LONGEST_PIPED", 1 << 20)
    with subprocess.Popen(["yes"], stdout=subprocess.PIPE) as endless:
        assert endless.stdout is not None
        try:
            with pytest.raises(InputError, match="more than 1 MB come through this pipe; allowed: text that ends"):
                irsim.load(f"/dev/fd/{endless.stdout.fileno()}")
        finally:
            endless.kill()
