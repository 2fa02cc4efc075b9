"""Names and digests of files that cannot be: one line each, with its place, the name and what is allowed."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from mesh_files import BOX

import irsim
from irsim.cli.figures import contact_sheet
from irsim.cli.video import moving_picture
from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.types import Source

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
def test_what_cannot_be_is_one_line_with_its_place(folder: Path, place: str, keys: str, said: str) -> None:
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
def test_a_file_that_is_gone_is_told_with_the_override_that_names_another(folder: Path, place: str) -> None:
    text, gone = TEXTS[place].replace("KEYS", "file: GONE"), f"gone{Path(FILES[place]).suffix}"
    said = f"{place}.file: {folder}/{gone}: there is no such file"
    assert told(text.replace("GONE", gone)).endswith(
        f": {said}; allowed: a file that is there; {place}.file=PATH puts another in its place"
    )
    assert irsim.loads(text.replace("GONE", gone), "f.yaml", [f"{place}.file={FILES[place]}"])
    assert (
        told(text.replace("GONE", FILES[place]), f"{place}.file={gone}")
        == f"override {said}; allowed: a file that is there"
    )
    (folder / gone).write_bytes(b"no such thing")
    assert "puts another" not in told(text.replace("GONE", gone))


def test_a_file_of_a_choice_that_is_gone_is_told_without_an_override(folder: Path) -> None:
    """The shape that stands there has no such key."""
    vary = "vary: {targets.a.shape: {kind: choice, values: [{kind: mesh, file: gone.obj, length_m: 3}, {kind: car}]}}"
    said = told(f"{CAR}{vary}")
    assert "gone.obj: there is no such file" in said
    assert "puts another" not in said


@pytest.mark.parametrize("name", ['"a\\0b"', "a" * 300, '""'])
def test_an_override_beside_such_a_name_is_one_line(name: str) -> None:
    """The default that it would begin from is the recording's."""
    text = TEXTS["background"].replace("KEYS", f"file: {name}")
    assert told(text, "background.range_k.0=250").startswith("override background.range_k.0: ")


@pytest.mark.parametrize("name", ["a\0b", "a" * 300])
def test_no_recording_has_such_a_name(name: str) -> None:
    with pytest.raises(InputError, match=r"^a.*: (no file can have this name|cannot be read): "):
        open_recording(name)


@pytest.mark.parametrize("place", TEXTS)
@pytest.mark.parametrize(("draw", "ending"), [(contact_sheet, "png"), (moving_picture, "gif")])
def test_a_picture_replaces_nothing_that_the_scene_is_read_from(
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
