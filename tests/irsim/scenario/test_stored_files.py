"""Scenes read from files: rendered from anywhere, changed files are noticed, places do not enter the hash."""

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
"""What the footage is of."""
TALL = BOX.replace(" 1\n", " 3\n")
"""The same box, three times as high."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder that holds scene.yaml, its mesh and, deeper, its footage."""
    project = tmp_path / "all" / "project"
    (project / "footage").mkdir(parents=True)
    irsim.record(irsim.Rendering(irsim.loads(GROUND)), project / "footage" / "own.mcap")
    (project / "box.obj").write_text(BOX)
    (project / "scene.yaml").write_text(SCENE)
    return project


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """Another folder, to give commands in."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    return folder


def pictures(path: Path) -> npt.NDArray[np.integer]:
    return np.stack([frame.image for frame in open_recording(path).frames()])


def change_mesh(path: Path) -> None:
    path.write_text(TALL)
    os.utime(path, ns=(0, 1))  # not within the same tick of the clock


@pytest.mark.parametrize("given", ["scene.yaml", "../project/scene.yaml"])
def test_a_recording_is_rendered_again_from_anywhere(project: Path, elsewhere: Path, run: Run, given: str) -> None:
    assert run("render", given, "-o", "made.mcap", cwd=project).returncode == 0
    again = run("render", str(project / "made.mcap"), "-o", "again.mcap", cwd=elsewhere)
    assert (again.returncode, again.stderr) == (0, "")
    assert np.array_equal(pictures(elsewhere / "again.mcap"), pictures(project / "made.mcap"))


def test_files_in_overrides_and_tables_are_found_again(project: Path, elsewhere: Path, run: Run) -> None:
    """At another severity, too; the mesh of severity 0 was noted with its digest, which is not the other's."""
    (project / "tall.obj").write_text(TALL)
    lists = "severities={targets.box.shape.file: [box.obj, tall.obj]}"
    assert run("render", "scene.yaml", lists, "-o", "made.mcap", cwd=project).returncode == 0
    own = "targets.box.shape.file=tall.obj"
    assert run("render", "scene.yaml", own, "-o", "tall.mcap", cwd=project).returncode == 0
    again = run("render", str(project / "made.mcap"), "severity=1", "-o", "again.mcap", cwd=elsewhere)
    assert (again.returncode, again.stderr) == (0, "")
    assert np.array_equal(pictures(elsewhere / "again.mcap"), pictures(project / "tall.mcap"))
    assert not np.array_equal(pictures(elsewhere / "again.mcap"), pictures(project / "made.mcap"))


def test_another_recording_has_a_digest_of_its_own(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By an override, by a change and by a range, though the first one's stands in the text."""
    scenario = irsim.load(project / "scene.yaml")
    noted = project / "noted.yaml"
    noted.write_text(irsim.dumps(scenario, folder=project))
    other = irsim.record(irsim.Rendering(irsim.loads(GROUND, overrides=["seed=1"])), project / "other.mcap")
    changed = irsim.change(scenario, {"background.file": str(other)})
    assert changed.hash != scenario.hash
    assert irsim.load(noted, [f"background.file={other}"]) == changed
    ranges = "vary={background.file: {kind: choice, values: [footage/own.mcap, other.mcap]}}"
    monkeypatch.chdir(project)
    drawn = irsim.sample(irsim.load(noted, [ranges]), 8)
    assert {each.background for each in drawn} == {scenario.background, changed.background}


@pytest.mark.parametrize("what", ["mesh", "footage"])
def test_a_changed_file_is_an_error_when_rendered_again(project: Path, run: Run, what: str) -> None:
    assert run("render", "scene.yaml", "-o", "made.mcap", cwd=project).returncode == 0
    if what == "mesh":
        place, file = "targets.box.shape", project / "box.obj"
        change_mesh(file)
    else:
        place, file = "background", project / "footage" / "own.mcap"
        irsim.record(irsim.Rendering(irsim.loads(GROUND, overrides=["seed=1"])), file)
    again = run("render", "made.mcap", "-o", "again.mcap", cwd=project)
    assert again.returncode == 2
    assert f"{place}.digest: {file} has changed: its digest is " in again.stderr
    assert again.stderr.count("\n") == 1
    assert not (project / "again.mcap").exists()
    named = run("render", "made.mcap", f"{place}.file={os.path.relpath(file, project)}", "-o", "a.mcap", cwd=project)
    assert named.returncode == 2  # it is the same file
    (digest,) = re.findall("its digest is ([0-9a-f]{32});", again.stderr)
    assert run("render", "made.mcap", f"{place}.digest={digest}", "-o", "again.mcap", cwd=project).returncode == 0
    assert not np.array_equal(pictures(project / "again.mcap"), pictures(project / "made.mcap"))


def test_moved_files_are_given_by_overrides(project: Path, elsewhere: Path, run: Run) -> None:
    assert run("render", "scene.yaml", "-o", "made.mcap", cwd=project).returncode == 0
    shutil.move(project, elsewhere / "moved")
    lost = run("render", "moved/made.mcap", "-o", "again.mcap", cwd=elsewhere)
    assert lost.returncode == 2
    for key, name in (("background.file", "footage/own.mcap"), ("targets.box.shape.file", "box.obj")):
        assert f"{key}: {project / name}: there is no such file; allowed: an existing file; {key}=" in lost.stderr
    new = ["background.file=moved/footage/own.mcap", "targets.box.shape.file=moved/box.obj"]
    assert run("render", "moved/made.mcap", *new, "-o", "again.mcap", cwd=elsewhere).returncode == 0
    assert np.array_equal(pictures(elsewhere / "again.mcap"), pictures(elsewhere / "moved" / "made.mcap"))


@pytest.mark.parametrize("output", ["drawn", "../drawn"])
def test_samples_move_with_their_files(
    project: Path, elsewhere: Path, run: Run, monkeypatch: pytest.MonkeyPatch, output: str
) -> None:
    assert run("sample", "scene.yaml", "-n", "2", "-o", output, cwd=project).returncode == 0
    monkeypatch.chdir(elsewhere)
    drawn = irsim.sample(irsim.load(project / "scene.yaml"), 2)
    assert [irsim.load(path) for path in sorted((project / output).glob("*.yaml"))] == drawn
    moved = Path(shutil.move(project.parent, elsewhere / "moved")) / "project"
    assert [irsim.load(path).hash for path in sorted((moved / output).glob("*.yaml"))] == [each.hash for each in drawn]
    change_mesh(moved / "box.obj")
    with pytest.raises(InputError, match=r"shape\.digest: \S+box\.obj has changed"):
        irsim.load(moved / output / "scene-0.yaml")


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


def test_names_of_files_do_not_enter_the_hash(project: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = irsim.load(project / "scene.yaml").hash
    monkeypatch.chdir(project)
    assert irsim.load("scene.yaml").hash == irsim.load("../project/scene.yaml").hash == expected
    copy = shutil.copytree(project, elsewhere / "copy")
    assert irsim.load(copy / "scene.yaml").hash == expected
    shutil.move(copy / "box.obj", copy / "other.obj")
    assert irsim.load(copy / "scene.yaml", [f"targets.box.shape.file={copy / 'other.obj'}"]).hash == expected
    change_mesh(copy / "other.obj")
    assert irsim.load(copy / "scene.yaml", [f"targets.box.shape.file={copy / 'other.obj'}"]).hash != expected


def test_only_names_beside_a_digest_leave_the_hash(project: Path) -> None:
    """Values of scenes without files are hashed as they are."""
    scenario = irsim.load(project / "scene.yaml")
    value = {"background": {"kind": "recording", "file": "a", "digest": "b"}, "seed": 1, "targets": [{"id": "file"}]}
    assert without_names(scenario, value) == {**value, "background": {"kind": "recording", "digest": "b"}}
    sky = irsim.load("sky")
    value = sky.model_dump(mode="json")
    assert without_names(sky, value) == value


class Two(Part):
    """Read from a file and its digest, and from another without."""

    file: FileName
    other: FileName = ""
    digest: str = ""


def test_a_name_without_a_digest_stays_in_the_hash() -> None:
    """Else two scenes would have one: the digest is that of what stands at `file`, where it has been filled in."""
    value = {"file": "a", "other": "b", "digest": "c"}
    assert without_names(Two(file="a"), value) == {"other": "b", "digest": "c"}
    assert without_names(Two(file="a"), {**value, "digest": ""}) == {**value, "digest": ""}


def test_a_digest_stays_when_another_key_changes() -> None:
    document = Document("text", {"file": "a", "other": "b", "digest": "c"}, {}, {})
    assert apply_override(document, "other=d", Two)[0].value == {"file": "a", "other": "d", "digest": "c"}
    assert apply_override(document, "file=d", Two)[0].value == {"file": "d", "other": "b"}


def test_a_given_digest_holds_in_any_order(project: Path) -> None:
    shutil.copy(project / "box.obj", project / "other.obj")
    given = ["targets.box.shape.digest=0a", f"targets.box.shape.file={project / 'other.obj'}"]
    scenario = irsim.load(project / "scene.yaml")
    for order in (given, given[::-1]):
        with pytest.raises(InputError, match=r"digest: \S+other\.obj has changed"):
            irsim.load(project / "scene.yaml", order)
        with pytest.raises(InputError, match=r"digest: \S+other\.obj has changed"):
            irsim.change(scenario, dict(each.split("=") for each in order))


def test_a_mesh_changed_after_loading_is_an_error(project: Path) -> None:
    rendering = irsim.Rendering(irsim.load(project / "scene.yaml"))
    rendering.frame(0)
    change_mesh(project / "box.obj")
    with pytest.raises(InputError, match=r"box\.obj: was changed after the scene was read"):
        rendering.frame(1)


def test_a_replaced_mesh_is_read_again(tmp_path: Path) -> None:
    """Though it is as old, as copies that keep times are."""
    paths = [tmp_path / "box.obj", tmp_path / "tall.obj"]
    for path, text in zip(paths, (BOX, TALL), strict=True):
        path.write_text(text)
        os.utime(path, ns=(0, 1))
    first = read_mesh(str(paths[0])).digest
    paths[1].replace(paths[0])
    assert read_mesh(str(paths[0])).digest != first


def test_a_recording_changed_after_loading_is_an_error(project: Path) -> None:
    scenario, footage = irsim.load(project / "scene.yaml"), project / "footage" / "own.mcap"
    irsim.record(irsim.Rendering(irsim.loads(GROUND, overrides=["seed=1"])), footage)
    with pytest.raises(InputError, match=r"own\.mcap: was changed after the scene was read"):
        irsim.Rendering(scenario).frame(0)
