"""Files named in scenarios: relative to the scenario, with errors at their place."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from mesh_files import BOX

import irsim
from irsim.cli.figures import contact_sheet
from irsim.cli.video import write_video
from irsim.config.paths import is_there
from irsim.errors import InputError
from irsim.lint.warnings import warnings
from irsim.recording import open_recording
from irsim.types import Source

SCENE = """\
frames: 2
camera: {size: [32, 24]}
background: {kind: ground}
targets:
  - id: box
    shape: {kind: mesh, file: box.obj, length_m: 4}
    path: {kind: straight, start: [9, 9]}
"""
OTHER = "{kind: mesh, file: other.obj, length_m: 2}"


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario in a folder of its own with its mesh, and the working directory another one."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    (tmp_path / "scenes" / "box.obj").write_text(BOX)
    path = tmp_path / "scenes" / "scene.yaml"
    path.write_text(SCENE)
    return path


def mesh_of(scenario: irsim.Scenario) -> str:
    return str(scenario.files[-1])


def test_a_mesh_is_found_from_anywhere(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert mesh_of(irsim.load(scene)) == str(scene.with_name("box.obj"))
    assert irsim.load("../scenes/scene.yaml") == irsim.load(scene)
    monkeypatch.chdir(scene.parent)
    assert irsim.load("scene.yaml") == irsim.load(scene)


def test_the_scenarios_folder_comes_first(scene: Path) -> None:
    Path("box.obj").write_text(BOX)
    assert mesh_of(irsim.load(scene)) == str(scene.with_name("box.obj"))
    scene.with_name("box.obj").unlink()
    assert mesh_of(irsim.load(scene)) == str(Path("box.obj").absolute())


def test_a_missing_file_is_named_in_the_scenarios_folder(scene: Path) -> None:
    scene.with_name("box.obj").unlink()
    with pytest.raises(
        InputError, match=r"scene\.yaml:6:31: targets\.box\.shape\.file: \S*scenes/box\.obj: there is no s"
    ):
        irsim.load(scene)


def test_an_override_is_relative_to_the_working_directory(scene: Path) -> None:
    Path("own.obj").write_text(BOX)
    assert mesh_of(irsim.load(scene, ["targets.box.shape.file=own.obj"])) == str(Path("own.obj").absolute())


def test_a_recorded_background_is_relative_too(scene: Path) -> None:
    irsim.record(irsim.Rendering(irsim.load(scene)), scene.with_name("real.mcap"))
    other = scene.with_name("other.yaml")
    other.write_text(SCENE.replace("{kind: ground}", "{kind: recording, file: real.mcap}"))
    scenario = irsim.load(other)
    assert scenario.files[0] == scene.with_name("real.mcap")
    recording = irsim.open_recording(irsim.record(irsim.Rendering(scenario), scene.with_name("again.mcap")))
    assert recording.scenario_text is not None
    again = irsim.loads(recording.scenario_text, trusted=False)
    assert (again, again.hash) == (scenario, scenario.hash)


def test_files_in_tables_are_relative_too(scene: Path) -> None:
    scene.with_name("other.obj").write_text(BOX)
    severities = "severities:\n  targets.box.shape.file: [box.obj, other.obj]\n"
    scene.write_text(SCENE + severities)
    assert mesh_of(irsim.load(scene, ["severity=1"])) == str(scene.with_name("other.obj"))
    scene.write_text(f"{SCENE}vary:\n  targets.box.shape: {{kind: choice, values: [{OTHER}]}}\n")
    assert warnings(scene) == []
    (drawn,) = irsim.sample(irsim.load(scene), 1)
    assert mesh_of(drawn) == str(scene.with_name("other.obj"))


GROUND = "frames: 2\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
TEXTS = {
    "background": GROUND.replace("kind: ground", "kind: recording, KEYS"),
    "targets.box.shape": f"{GROUND}targets:\n"
    "  - {id: box, path: {kind: straight, start: [9, 9]}, shape: {kind: mesh, length_m: 4, KEYS}}\n",
}
FILES = {"background": "own.mcap", "targets.box.shape": "box.obj"}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with files to name."""
    irsim.record(irsim.Rendering(irsim.loads(GROUND)), tmp_path / FILES["background"])
    (tmp_path / FILES["targets.box.shape"]).write_text(BOX)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def told(text: str, *overrides: str) -> str:
    """The one line that is told."""
    with pytest.raises(InputError) as caught:
        irsim.loads(text, "f.yaml", overrides)
    (line,) = str(caught.value).splitlines()
    return line


CAR = """
background: {kind: sky}
targets: [{id: a, shape: {kind: car}, path: {kind: straight, start: [5, 24], speed: 1, range_m: 500}}]
"""


@pytest.mark.parametrize("place", TEXTS)
@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ('file: "a\\0b"', "file: {folder}/a\\x00b: no file can have this name; allowed: no zero bytes, "),
        (f"file: {'a' * 300}", f"file: {{folder}}/{'a' * 300}: cannot be read: File name too long"),
        ('file: ""', "file: the name is empty; allowed: the name of a file"),
        ("file: FILE, digest: 0", "digest: expected text, not 0; allowed: text"),
        ("file: FILE, digest: null", "digest: expected text, not nothing; allowed: text"),
        ('file: FILE, digest: "5"', "digest: {folder}/FILE has changed: its digest is "),
    ],
)
def test_an_impossible_name_is_one_line_with_its_place(folder: Path, place: str, keys: str, said: str) -> None:
    text, line = (each.replace("FILE", FILES[place]) for each in (TEXTS[place].replace("KEYS", keys), said))
    assert f": {place}.{line.format(folder=folder)}" in told(text)


@pytest.mark.parametrize("place", TEXTS)
def test_a_device_is_not_read(folder: Path, place: str) -> None:
    """One may have no end."""
    name = f"device{Path(FILES[place]).suffix}"
    (folder / name).symlink_to(os.devnull)
    text = TEXTS[place].replace("KEYS", f"file: {name}")
    assert f"{place}.file: {folder}/{name}: is no regular file; allowed: " in told(text)


@pytest.mark.parametrize("place", TEXTS)
def test_a_missing_file_suggests_an_override(folder: Path, place: str) -> None:
    text, gone = TEXTS[place].replace("KEYS", "file: GONE"), f"gone{Path(FILES[place]).suffix}"
    said = f"{place}.file: {folder}/{gone}: there is no such file"
    assert told(text.replace("GONE", gone)).endswith(
        f": {said}; allowed: an existing file; {place}.file=PATH selects another file"
    )
    assert irsim.loads(text.replace("GONE", gone), "f.yaml", [f"{place}.file={FILES[place]}"])
    assert (
        told(text.replace("GONE", FILES[place]), f"{place}.file={gone}")
        == f"override {said}; allowed: an existing file"
    )
    (folder / gone).write_bytes(b"no such thing")
    assert "selects another" not in told(text.replace("GONE", gone))


def test_a_missing_file_of_a_choice_suggests_no_override(folder: Path) -> None:
    """The shape that stands there has no such key."""
    vary = "vary: {targets.a.shape: {kind: choice, values: [{kind: mesh, file: gone.obj, length_m: 3}, {kind: car}]}}"
    said = told(f"{CAR}{vary}")
    assert "gone.obj: there is no such file" in said
    assert "selects another" not in said


@pytest.mark.parametrize("name", ["a\0b", "a" * 300])
def test_no_recording_has_such_a_name(name: str) -> None:
    with pytest.raises(InputError, match=r"^a.*: (no file can have this name|cannot be read): "):
        open_recording(name)


@pytest.mark.parametrize("place", TEXTS)
@pytest.mark.parametrize(("draw", "ending"), [(contact_sheet, "png"), (write_video, "gif")])
def test_a_picture_replaces_no_file_of_the_scene(
    draw: Callable[[Source, Path], Path], ending: str, place: str, folder: Path
) -> None:
    """Nor through a link."""
    read, link = folder / FILES[place], folder / f"x.{ending}"
    link.symlink_to(read)
    source = irsim.Rendering(irsim.loads(TEXTS[place].replace("KEYS", f"file: {FILES[place]}")))
    before = read.read_bytes()
    with pytest.raises(InputError, match=f"would replace {read}, which this command needs; allowed: another name"):
        draw(source, link)
    assert read.read_bytes() == before


def test_a_shells_pipe_is_read_repeatedly() -> None:
    """And no more of it than a text may have."""
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


@pytest.mark.parametrize("name", ["x" * 300, "a\0b", "f/" * 3000])
def test_an_impossible_name_does_not_exist(name: str) -> None:
    assert not is_there(name)
