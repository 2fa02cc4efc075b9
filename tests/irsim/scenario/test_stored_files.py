"""Scenes read from files: rendered from any folder, changed files are errors, names do not enter the hash."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from command_line import Run
from mesh_files import BOX

import irsim
from irsim.config.base import Part
from irsim.config.overrides import apply_override
from irsim.config.quantities import FileName
from irsim.config.yaml_text import Document
from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.scenario.fingerprint import without_names
from irsim.targets.meshfile import read_mesh

SCENE = """\
frames: 3
camera: {size: [32, 24]}
background: {kind: recording, file: footage/own.mcap}
targets:
  - id: box
    shape: {kind: mesh, file: box.obj, length_m: 4, temperature_k: 380}
    path: {kind: straight, start: [15, 12], range_m: 800}
vary:
  targets.box.path.speed: {kind: uniform, low: 0.1, high: 0.3}
"""
GROUND = "frames: 2\ncamera: {size: [32, 24]}\nbackground: {kind: ground}\n"
TALL = BOX.replace(" 1\n", " 3\n")
"""The same box, three times as high."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with scene.yaml, its mesh and, deeper, its footage of ground."""
    project = tmp_path / "all" / "project"
    (project / "footage").mkdir(parents=True)
    irsim.record(irsim.Rendering(irsim.loads(GROUND)), project / "footage" / "own.mcap")
    (project / "box.obj").write_text(BOX)
    (project / "scene.yaml").write_text(SCENE)
    return project


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    return folder


def images(path: Path) -> npt.NDArray[np.integer]:
    return np.stack([frame.image for frame in open_recording(path).frames()])


def change_mesh(path: Path) -> None:
    path.write_text(TALL)
    os.utime(path, ns=(0, 1))  # not within the same tick of the clock


def change_footage(path: Path) -> None:
    irsim.record(irsim.Rendering(irsim.loads(GROUND, overrides=["seed=1"])), path)


def test_files_are_found_from_another_folder(project: Path, elsewhere: Path, run: Run) -> None:
    """At another severity too, whose mesh has another digest; moved files are named by overrides."""
    (project / "tall.obj").write_text(TALL)
    lists = "severities={targets.box.shape.file: [box.obj, tall.obj]}"
    assert run("render", "../project/scene.yaml", lists, "-o", "made.mcap", cwd=project).returncode == 0
    own = "targets.box.shape.file=tall.obj"
    assert run("render", "scene.yaml", own, "-o", "tall.mcap", cwd=project).returncode == 0
    for severity, equal in ((0, "made.mcap"), (1, "tall.mcap")):
        again = run("render", str(project / "made.mcap"), f"severity={severity}", "-o", "again.mcap", cwd=elsewhere)
        assert (again.returncode, again.stderr) == (0, "")
        assert np.array_equal(images(elsewhere / "again.mcap"), images(project / equal))
    assert not np.array_equal(images(project / "tall.mcap"), images(project / "made.mcap"))
    shutil.move(project, elsewhere / "moved")
    lost = run("render", "moved/tall.mcap", "-o", "again.mcap", cwd=elsewhere)
    assert lost.returncode == 2
    for key, name in (("background.file", "footage/own.mcap"), ("targets.box.shape.file", "tall.obj")):
        assert f"{key}: {project / name}: there is no such file; allowed: an existing file; {key}=" in lost.stderr
    new = ["background.file=moved/footage/own.mcap", "targets.box.shape.file=moved/tall.obj"]
    assert run("render", "moved/tall.mcap", *new, "-o", "again.mcap", cwd=elsewhere).returncode == 0
    assert np.array_equal(images(elsewhere / "again.mcap"), images(elsewhere / "moved" / "tall.mcap"))


def test_another_recording_has_its_own_digest(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By an override, a change and a range, though the text contains the digest of the first."""
    scenario = irsim.load(project / "scene.yaml")
    noted = project / "noted.yaml"
    noted.write_text(irsim.dumps(scenario, folder=project))
    change_footage(project / "other.mcap")
    changed = irsim.change(scenario, {"background.file": str(project / "other.mcap")})
    assert changed.hash != scenario.hash
    assert irsim.load(noted, [f"background.file={project / 'other.mcap'}"]) == changed
    ranges = "vary={background.file: {kind: choice, values: [footage/own.mcap, other.mcap]}}"
    monkeypatch.chdir(project)
    drawn = irsim.sample(irsim.load(noted, [ranges]), 8)
    assert {each.background for each in drawn} == {scenario.background, changed.background}


@pytest.mark.parametrize(
    ("place", "name", "modify"),
    [("targets.box.shape", "box.obj", change_mesh), ("background", "footage/own.mcap", change_footage)],
)
def test_a_changed_file_is_an_error(project: Path, run: Run, place: str, name: str, modify: object) -> None:
    assert callable(modify)
    file, rendering = project / name, irsim.Rendering(irsim.load(project / "scene.yaml"))
    irsim.record(rendering, project / "made.mcap")
    modify(file)
    with pytest.raises(InputError, match="was changed after the scene was read"):
        irsim.Rendering(rendering.scenario).frame(1)
    again = run("render", "made.mcap", "-o", "again.mcap", cwd=project)
    assert again.returncode == 2
    assert f"{place}.digest: {file} has changed: its digest is " in again.stderr
    assert again.stderr.count("\n") == 1
    assert not (project / "again.mcap").exists()
    (digest,) = re.findall("its digest is ([0-9a-f]{32});", again.stderr)
    assert run("render", "made.mcap", f"{place}.digest={digest}", "-o", "again.mcap", cwd=project).returncode == 0
    assert not np.array_equal(images(project / "again.mcap"), images(project / "made.mcap"))


def test_samples_move_with_their_files(
    project: Path, elsewhere: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("sample", "scene.yaml", "-n", "2", "-o", "../drawn", cwd=project).returncode == 0
    monkeypatch.chdir(elsewhere)
    drawn = irsim.sample(irsim.load(project / "scene.yaml"), 2)
    assert [irsim.load(path) for path in sorted((project.parent / "drawn").glob("*.yaml"))] == drawn
    moved = Path(shutil.move(project.parent, elsewhere / "moved"))
    assert [irsim.load(path).hash for path in sorted((moved / "drawn").glob("*.yaml"))] == [each.hash for each in drawn]
    change_mesh(moved / "project" / "box.obj")
    with pytest.raises(InputError, match=r"shape\.digest: \S+box\.obj has changed"):
        irsim.load(moved / "drawn" / "scene-0.yaml")


def test_names_are_relative_where_a_folder_is_shared(project: Path) -> None:
    scenario = irsim.load(project / "scene.yaml")
    assert f"file: {project / 'box.obj'}\n" in irsim.dumps(scenario)
    assert "file: ../project/box.obj\n" in irsim.dumps(scenario, folder=project.parent / "other")
    assert f"file: {project / 'box.obj'}\n" in irsim.dumps(scenario, folder="/elsewhere/on/this/machine")


def test_a_scene_survives_a_change_of_directory(
    project: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(project)
    scenario, expected = irsim.loads(SCENE), irsim.Rendering(irsim.load("scene.yaml")).frame(2).image
    monkeypatch.chdir(elsewhere)
    assert np.array_equal(irsim.Rendering(scenario).frame(2).image, expected)
    assert irsim.change(scenario, {"seed": 0}) == scenario == irsim.loads(irsim.dumps(scenario))


class Two(Part):
    """Part with a file and its digest, and with another file."""

    file: FileName
    other: FileName = ""
    digest: str = ""


def test_names_of_files_do_not_enter_the_hash(project: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name without a digest does: two scenes of different files would have one hash."""
    scenario = irsim.load(project / "scene.yaml")
    monkeypatch.chdir(project)
    assert irsim.load("../project/scene.yaml").hash == scenario.hash
    copy = shutil.copytree(project, elsewhere / "copy")
    shutil.move(copy / "box.obj", copy / "other.obj")
    override = f"targets.box.shape.file={copy / 'other.obj'}"
    assert irsim.load(copy / "scene.yaml", [override]).hash == scenario.hash
    change_mesh(copy / "other.obj")
    assert irsim.load(copy / "scene.yaml", [override]).hash != scenario.hash
    value = {"file": "a", "other": "b", "digest": "c"}
    assert without_names(Two(file="a"), value) == {"other": "b", "digest": "c"}
    assert without_names(Two(file="a"), {**value, "digest": ""}) == {**value, "digest": ""}


def test_a_digest_belongs_to_its_file(project: Path) -> None:
    """It is removed with another file, and kept where it is given by hand, in any order."""
    document = Document("text", {"file": "a", "other": "b", "digest": "c"}, {}, {})
    assert apply_override(document, "other=d", Two)[0].value == {"file": "a", "other": "d", "digest": "c"}
    assert apply_override(document, "file=d", Two)[0].value == {"file": "d", "other": "b"}
    shutil.copy(project / "box.obj", project / "other.obj")
    given = ["targets.box.shape.digest=0a", f"targets.box.shape.file={project / 'other.obj'}"]
    for order in (given, given[::-1]):
        with pytest.raises(InputError, match=r"digest: \S+other\.obj has changed"):
            irsim.load(project / "scene.yaml", order)


def test_a_replaced_mesh_is_read_again(tmp_path: Path) -> None:
    """Also one of equal age, as copies that keep times are."""
    paths = [tmp_path / "box.obj", tmp_path / "tall.obj"]
    for path, text in zip(paths, (BOX, TALL), strict=True):
        path.write_text(text)
        os.utime(path, ns=(0, 1))
    first = read_mesh(str(paths[0])).digest
    paths[1].replace(paths[0])
    assert read_mesh(str(paths[0])).digest != first
