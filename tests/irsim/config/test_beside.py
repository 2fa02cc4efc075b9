"""Files that a scenario names are looked for beside it, wherever the command is given."""

from __future__ import annotations

from pathlib import Path

import pytest
from mesh_files import BOX

import irsim
from irsim.errors import InputError
from irsim.lint.warnings import warnings

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


def test_a_mesh_beside_the_scenario_is_found_from_anywhere(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert mesh_of(irsim.load(scene)) == str(scene.with_name("box.obj"))
    assert irsim.load("../scenes/scene.yaml") == irsim.load(scene)
    monkeypatch.chdir(scene.parent)
    assert irsim.load("scene.yaml") == irsim.load(scene)


def test_what_is_in_the_working_directory_alone_is_found_too_and_that_beside_comes_first(scene: Path) -> None:
    Path("box.obj").write_text(BOX)
    assert mesh_of(irsim.load(scene)) == str(scene.with_name("box.obj"))
    scene.with_name("box.obj").unlink()
    assert mesh_of(irsim.load(scene)) == str(Path("box.obj").absolute())


def test_one_that_is_nowhere_is_named_where_it_was_looked_for(scene: Path) -> None:
    scene.with_name("box.obj").unlink()
    with pytest.raises(
        InputError, match=r"scene\.yaml:6:31: targets\.box\.shape\.file: \S*scenes/box\.obj: there is no s"
    ):
        irsim.load(scene)


def test_an_override_is_looked_for_where_the_command_is_given(scene: Path) -> None:
    Path("own.obj").write_text(BOX)
    assert mesh_of(irsim.load(scene, ["targets.box.shape.file=own.obj"])) == str(Path("own.obj").absolute())


def test_a_recorded_background_lies_beside_its_scenario_and_the_recording_of_it_is_rendered_again(scene: Path) -> None:
    irsim.record(irsim.Rendering(irsim.load(scene)), scene.with_name("real.mcap"))
    other = scene.with_name("other.yaml")
    other.write_text(SCENE.replace("{kind: ground}", "{kind: recording, file: real.mcap}"))
    scenario = irsim.load(other)
    assert scenario.files[0] == scene.with_name("real.mcap")
    recording = irsim.open_recording(irsim.record(irsim.Rendering(scenario), scene.with_name("again.mcap")))
    assert recording.scenario_text is not None
    again = irsim.loads(recording.scenario_text, trusted=False)
    assert (again, again.hash) == (scenario, scenario.hash)


def test_files_under_severities_and_vary_lie_there_too(scene: Path) -> None:
    scene.with_name("other.obj").write_text(BOX)
    severities = "severities:\n  targets.box.shape.file: [box.obj, other.obj]\n"
    scene.write_text(SCENE + severities)
    assert mesh_of(irsim.load(scene, ["severity=1"])) == str(scene.with_name("other.obj"))
    scene.write_text(f"{SCENE}vary:\n  targets.box.shape: {{kind: choice, values: [{OTHER}]}}\n")
    assert warnings(scene) == []
    (drawn,) = irsim.sample(irsim.load(scene), 1)
    assert mesh_of(drawn) == str(scene.with_name("other.obj"))
