"""Shipped scenarios, starting points, the JSON Schema and samples."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import jsonschema
import pytest
from command_line import Run
from scenario_text import TEXT

import irsim
from irsim.config.yaml_text import read_yaml
from irsim.errors import InputError
from irsim.scenario.catalog import examples, find, json_schema
from irsim.scenario.loader import dumps, load, loads


@cache
def validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(json_schema())


@pytest.mark.usefixtures("beside_footage")
def test_a_new_scenario_is_valid_and_renders(tmp_path: Path, run: Run) -> None:
    assert run("new", "ground", cwd=tmp_path).stdout == "ground.yaml\nshow it: irsim show ground.yaml\n"
    checked = run("check", "ground.yaml", cwd=tmp_path)
    assert (checked.returncode, checked.stdout, checked.stderr) == (0, "ground.yaml: ok\n", "")
    rendering = irsim.Rendering(load(tmp_path / "ground.yaml"))
    first = rendering.frame(0).image
    assert first.max() > first.min()
    target = next(iter(rendering.truths())).target(rendering.follow or "")
    assert target is not None
    assert target.visible == pytest.approx(1, abs=1e-3)


def test_a_new_scenario_names_its_missing_file(tmp_path: Path, run: Run) -> None:
    done = run("new", "recording", cwd=tmp_path)
    assert done.returncode == 0
    assert "show it, once this is corrected: irsim show recording.yaml\nrecording.yaml:" in done.stdout
    assert "footage.mcap: there is no such file" in done.stdout


def test_a_new_scenario_replaces_nothing(tmp_path: Path, run: Run) -> None:
    (tmp_path / "sky.yaml").write_text("mine")
    done = run("new", "sky", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("irsim: sky.yaml: is there already, and a new scenario replaces nothing")
    assert (tmp_path / "sky.yaml").read_text() == "mine"
    done = run("new", "se", cwd=tmp_path)
    assert done.stderr.startswith("irsim: se: there is no such kind of scenario; allowed: ground, ")
    assert done.stderr.endswith("did you mean 'sea'?\n")


def test_the_schema_is_valid_and_is_printed(tmp_path: Path, run: Run) -> None:
    jsonschema.Draft202012Validator.check_schema(json_schema())
    assert json.loads(run("schema", cwd=tmp_path).stdout) == json_schema()


@pytest.mark.usefixtures("beside_footage")
@pytest.mark.parametrize("name", ["sea", "sources/an-false", "stress/hard-6x6", "new/recording"])
def test_the_schema_accepts_shipped_scenarios(name: str) -> None:
    validator().validate(read_yaml(find(name)).value)
    validator().validate(irsim.scalar(dumps(load(name))))


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("frames: 1e1", "framse: 3", ""),
        ("netd_mk: 60", "netd: 60", "camera"),
        ("netd_mk: 60", "netd_mk: sixty", "camera.netd_mk"),
        ("size: [64, 48]", "size: [64]", "camera.size"),
        ("kind: ar1", "kind: ar2", "camera.noise.1.kind"),
        ("rho: 0.9", "rhu: 0.9", "camera.noise.1"),
        ("coverage: 0.3", "cover: 0.3", "background.clouds.0"),
    ],
)
def test_the_schema_marks_a_fault_at_its_place(old: str, new: str, place: str) -> None:
    wrong = list(validator().iter_errors(irsim.scalar(TEXT.replace(old, new))))
    assert {".".join(map(str, error.absolute_path)) for error in wrong} == {place}


def test_the_schema_accepts_own_kinds() -> None:
    validator().validate(irsim.scalar(TEXT.replace("kind: sky", "kind: 'mine:Sky'").replace("coverage", "anything")))


VARIED = (
    TEXT
    + """\
vary:
  targets.jet.path.speed: {kind: uniform, low: 1, high: 4}
  camera.netd_mk: {kind: loguniform, low: 20, high: 200}
"""
)


def test_samples_are_files_that_name_their_command(tmp_path: Path, run: Run) -> None:
    (tmp_path / "mine.yaml").write_text(VARIED)
    done = run("sample", "mine.yaml", "camera.bits=12", "-n", "11", "--seed", "4", "-o", "many", cwd=tmp_path)
    assert done.stdout == "many: 11 scenarios, mine-00.yaml to mine-10.yaml\n"
    files = sorted((tmp_path / "many").iterdir())
    assert [path.name for path in files] == [f"mine-{k:02}.yaml" for k in range(11)]
    drawn = irsim.sample(loads(VARIED, overrides=["camera.bits=12"]), 11, seed=4)
    assert [load(path) for path in files] == drawn
    head = files[3].read_text().splitlines()
    repeat = "irsim sample mine.yaml camera.bits=12 -n 11 --seed 4"
    assert head[0] == f"# Sample 3 of 11 drawn from mine; all of them again: {repeat}"
    assert head[2] == f"# camera.netd_mk = {drawn[3].camera.netd_mk!r}"
    before = [path.read_bytes() for path in files]
    assert run(*repeat.split()[1:], "-o", "many", cwd=tmp_path).returncode == 0
    assert [path.read_bytes() for path in files] == before
    (tmp_path / "many" / "mine-other.yaml").write_text("mine")
    done = run("sample", "mine.yaml", "-n", "10", "-o", "many", cwd=tmp_path)
    problem = "many: holds samples of another call that would stay among the new ones, mine-00.yaml and "
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"irsim: {problem}")
    assert [path.read_bytes() for path in files] == before


def test_a_failed_sample_writes_nothing(tmp_path: Path, run: Run) -> None:
    (tmp_path / "still.yaml").write_text(TEXT)
    done = run("sample", "still.yaml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("irsim: vary: nothing varies in this scenario; allowed: override keys")
    (tmp_path / "mine-0.yaml").write_text(VARIED)
    done = run("sample", "mine-0.yaml", "-o", "mine-0.yaml", cwd=tmp_path)
    assert done.stderr == "irsim: mine-0.yaml: is no folder; allowed: the name of a folder\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine-0.yaml", "still.yaml"]


def test_shipped_names() -> None:
    assert find("sky") == examples()["sky"]
    with pytest.raises(irsim.InputError, match=r"^stress/nois: there is no such file .*did you mean 'stress/noise'\?$"):
        find("stress/nois")
    assert find("stress/noise.yaml") == Path("stress/noise.yaml")


def test_check_tries_every_severity_and_range(tmp_path: Path, run: Run) -> None:
    """`load` does neither: it validates one severity, and gives no warnings."""
    text = VARIED + "severities:\n  camera.bits: [8, 12, 20]\nwithout: [jet]\n"
    (tmp_path / "odd.yaml").write_text(text)
    load(tmp_path / "odd.yaml")
    done = run("check", "odd.yaml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("odd.yaml:30:24: camera.bits: 20 is out of range; allowed: ")
    (tmp_path / "odd.yaml").write_text(text.replace("12, 20", "12, 14"))
    done = run("check", "odd.yaml", cwd=tmp_path)
    assert done.returncode == 0
    assert "odd.yaml:27:27: vary.targets.jet.path.speed: warning: its part is switched off\n" in done.stderr


CROSSED = """\
frames: 60
camera: {size: [160, 120]}
background: {kind: sky}
targets:
  - id: a
    shape: {kind: point}
    path: {kind: straight, start: [20, 60], speed: 2}
  - id: b
    shape: {kind: point}
    path: {kind: crosses, target: a, at_frame: 30, angle_deg: 90, speed: 1}
vary:
  targets.b.path.at_frame: {kind: integers, low: 20, high: 400}
"""


def test_check_warns_of_impossible_scenes_of_a_range(tmp_path: Path, run: Run) -> None:
    (tmp_path / "crossed.yaml").write_text(CROSSED)
    done = run("check", "crossed.yaml", cwd=tmp_path)
    assert done.stderr == (
        "crossed.yaml:12:60: vary.targets.b.path.at_frame.high: warning: with 400 no scenario can be made: "
        "there is no frame 400; allowed: 0 to 59, or more frames, of which the first 60 can be rendered alone "
        "(--frames N)\n"
    )


def test_an_impossible_draw_is_named_with_its_values() -> None:
    """The faster the target, the wider a bar must be to hide it so long: at some speeds none can."""
    scenario = irsim.loads(
        """
frames: 60
camera: {size: [160, 120]}
background: {kind: sky}
targets: [{id: a, shape: {kind: fighter}, path: {kind: straight, start: [20, 60], speed: 1.5, range_m: 1500}}]
occluders: [{kind: bar, id: wall, hides: a, frames: [40, 50], range_m: 500}]
vary: {targets.a.path.speed: {kind: uniform, low: 0.5, high: 3}}
"""
    )
    with pytest.raises(InputError, match=r"^draw \d+ of seed 0 cannot be \(targets\.a\.path\.speed=[\d.]+\): .*wall"):
        irsim.sample(scenario, 40)


def test_every_example_is_in_the_documents() -> None:
    docs = Path(__file__).parents[3] / "docs"
    page = (docs / "examples.md").read_text()
    for name in examples():
        assert f"## {name}\n\n{read_yaml(examples()[name]).value['about']}\n" in page
        assert (docs / "img" / f"{name}.png").is_file()
