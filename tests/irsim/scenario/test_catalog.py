"""Shipped scenarios, starting points, the JSON Schema and samples."""

from __future__ import annotations

import json
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from command_line import Run
from mesh_files import BOX
from scenario_text import TEXT

import irsim
from irsim.calibration.stretch import jumps
from irsim.config.yaml_text import read_yaml
from irsim.errors import InputError
from irsim.occluders.solid import Building
from irsim.occluders.tree import Tree
from irsim.render.frame import Renderer
from irsim.scenario.catalog import examples, find, json_schema, shipped
from irsim.scenario.loader import dumps, load, loads
from irtrack.bench import run_bench

SHIPPED = {
    f"{folder}/{name}": path
    for folder in ("examples", "sources", "stress", "new")
    for name, path in shipped(folder).items()
}


@cache
def validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(json_schema())


@pytest.mark.usefixtures("beside_footage")
@pytest.mark.parametrize("name", ["sky", "ground"])
def test_a_new_scenario_is_in_order_and_renders(name: str, tmp_path: Path, run: Run) -> None:
    assert run("new", name, cwd=tmp_path).stdout == f"{name}.yaml\nshow it: irsim show {name}.yaml\n"
    checked = run("check", f"{name}.yaml", cwd=tmp_path)
    assert (checked.returncode, checked.stdout, checked.stderr) == (0, f"{name}.yaml: ok\n", "")
    rendering = irsim.Rendering(load(tmp_path / f"{name}.yaml"))
    first = rendering.frame(0).image
    assert first.max() > first.min()
    target = next(iter(rendering.truths())).target(rendering.follow or "")
    assert target is not None
    assert target.visible == pytest.approx(1, abs=1e-3)


def test_a_new_scenario_says_what_is_to_be_there_first(tmp_path: Path, run: Run) -> None:
    told = run("new", "recording", cwd=tmp_path)
    assert told.returncode == 0
    assert "show it, once this is corrected: irsim show recording.yaml\nrecording.yaml:" in told.stdout
    assert "footage.mcap: there is no such file" in told.stdout


def test_a_new_scenario_replaces_nothing(tmp_path: Path, run: Run) -> None:
    (tmp_path / "sky.yaml").write_text("mine")
    done = run("new", "sky", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("irsim: sky.yaml: is there already, and a new scenario replaces nothing")
    assert (tmp_path / "sky.yaml").read_text() == "mine"
    done = run("new", "sea", "-o", "no/sea.yaml", cwd=tmp_path)
    assert done.stderr == "irsim: no/sea.yaml: the folder no does not exist; allowed: an existing folder\n"
    done = run("new", "se", cwd=tmp_path)
    assert done.stderr.startswith("irsim: se: there is no such kind of scenario; allowed: ground, ")
    assert done.stderr.endswith("did you mean 'sea'?\n")


def test_the_schema_is_one_and_is_printed(tmp_path: Path, run: Run) -> None:
    jsonschema.Draft202012Validator.check_schema(json_schema())
    assert json.loads(run("schema", cwd=tmp_path).stdout) == json_schema()
    assert run("schema", "-o", "s.json", cwd=tmp_path).stdout == "s.json\n"
    assert json.loads((tmp_path / "s.json").read_text()) == json_schema()


@pytest.mark.usefixtures("beside_footage")
@pytest.mark.parametrize("name", list(SHIPPED)[::9])
def test_the_schema_takes_every_shipped_scenario(name: str) -> None:
    validator().validate(read_yaml(SHIPPED[name]).value)
    validator().validate(loads_plain(dumps(load(SHIPPED[name]))))


def loads_plain(text: str) -> Any:
    return irsim.scalar(text)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("frames: 1e1", "framse: 3", ""),
        ("netd_mk: 60", "netd: 60", "camera"),
        ("netd_mk: 60", "netd_mk: sixty", "camera.netd_mk"),
        ("netd_mk: 60", "netd_mk: -1", "camera.netd_mk"),
        ("size: [64, 48]", "size: [64]", "camera.size"),
        ("kind: ar1", "kind: ar2", "camera.noise.1.kind"),
        ("rho: 0.9", "rhu: 0.9", "camera.noise.1"),
        ("kind: sky", "kind: skies", "background.kind"),
        ("coverage: 0.3", "cover: 0.3", "background.clouds.0"),
        ("temperature_k: 500", "temperature: 500", "targets.0.shape"),
        ("speed: 2", "speed: fast", "targets.0.path.speed"),
    ],
)
def test_the_schema_marks_what_is_wrong_where_it_stands(old: str, new: str, place: str) -> None:
    assert old in TEXT
    wrong = list(validator().iter_errors(irsim.scalar(TEXT.replace(old, new))))
    assert {".".join(map(str, error.absolute_path)) for error in wrong} == {place}


def test_the_schema_takes_kinds_of_ones_own() -> None:
    validator().validate(irsim.scalar(TEXT.replace("kind: sky", "kind: 'mine:Sky'").replace("coverage", "anything")))


VARIED = (
    TEXT
    + """\
vary:
  targets.jet.path.speed: {kind: uniform, low: 1, high: 4}
  camera.netd_mk: {kind: loguniform, low: 20, high: 200}
"""
)


def test_samples_are_files_that_load_and_say_how_to_repeat(tmp_path: Path, run: Run) -> None:
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
    told = "many: holds samples of another call that would stay among the new ones, mine-00.yaml and 10 more; allowed: "
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"irsim: {told}")
    assert [path.read_bytes() for path in files] == before


def test_samples_replace_no_file_of_the_scenario(tmp_path: Path, run: Run) -> None:
    """Nor through a link."""
    box = tmp_path / "box.obj"
    box.write_text(BOX)
    target = "{id: box, shape: {kind: mesh, file: box.obj, length_m: 4}, path: {kind: straight, start: [9, 9]}}"
    vary = "vary: {camera.netd_mk: {kind: uniform, low: 20, high: 30}}"
    (tmp_path / "mine.yaml").write_text(f"background: {{kind: sky}}\ntargets: [{target}]\n{vary}\n")
    (tmp_path / "many").mkdir()
    (tmp_path / "many" / "mine-0.yaml").symlink_to(box)
    done = run("sample", "mine.yaml", "-n", "1", "-o", "many", cwd=tmp_path)
    assert done.stderr.startswith(f"irsim: many/mine-0.yaml: would replace {box}, which this command needs; allowed: ")
    assert box.read_text() == BOX


def test_a_failed_sample_writes_nothing(tmp_path: Path, run: Run) -> None:
    (tmp_path / "still.yaml").write_text(TEXT)
    done = run("sample", "still.yaml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("irsim: vary: nothing varies in this scenario; allowed: override keys")
    (tmp_path / "mine-0.yaml").write_text(VARIED)
    done = run("sample", "mine-0.yaml", "-o", "mine-0.yaml", cwd=tmp_path)
    assert done.stderr == "irsim: mine-0.yaml: is no folder; allowed: the name of a folder\n"
    (tmp_path / "mine.yaml").write_text(VARIED)
    (tmp_path / "mine.yaml").rename(tmp_path / "mine-0-0.yaml")
    done = run("sample", "mine-0.yaml", "-n", "1", "-o", ".", cwd=tmp_path)
    assert done.returncode == 0  # mine-0-0.yaml is another file than the one that is read
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine-0-0.yaml", "mine-0.yaml", "still.yaml"]


def test_shipped_names() -> None:
    assert find("sky") == examples()["sky"]
    with pytest.raises(irsim.InputError, match=r"^stress/nois: there is no such file .*did you mean 'stress/noise'\?$"):
        find("stress/nois")
    assert find("stress/noise.yaml") == Path("stress/noise.yaml")


def test_check_tries_every_severity_and_range(tmp_path: Path, run: Run) -> None:
    """What a load need not find: another severity that cannot be, a range without effect."""
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


CLOUDED = """\
frames: 10
background: {kind: sky, clouds: [{id: high}, {id: low}]}
without: [low]
vary:
  background.clouds.high.coverage: {kind: uniform, low: 0.1, high: 0.2}
  background.clouds.low.coverage: {kind: uniform, low: 0.1, high: 0.2}
"""


def test_check_warns_of_ranges_of_a_switched_off_cloud(tmp_path: Path, run: Run) -> None:
    (tmp_path / "clouded.yaml").write_text(CLOUDED)
    told = [line for line in run("check", "clouded.yaml", cwd=tmp_path).stderr.splitlines() if "switched off" in line]
    assert [line.partition(": ")[2] for line in told] == [
        "vary.background.clouds.low.coverage: warning: its part is switched off"
    ]


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


SEEDS = 30


@lru_cache
def loaded(name: str) -> irsim.Scenario:
    """Of some the loading takes seconds: what hides a target is placed meanwhile."""
    return irsim.load(name)


@pytest.mark.parametrize("name", list(examples())[::4])
def test_an_example_shows_its_target_without_a_cut(name: str) -> None:
    """No picture of it is a jump from the one before (`irsim.calibration.stretch.jumps`)."""
    rendering = irsim.Rendering(loaded(name))
    assert rendering.scenario.about
    assert examples()[name].read_text().startswith("#")
    pairs = list(rendering.pairs(stop=30))
    _, truth = pairs[0]
    assert truth is not None
    target = truth.target(rendering.follow or "")
    assert target is not None
    assert target.visible is not None
    assert target.visible >= 0.5
    assert jumps([frame.image for frame, _ in pairs]) == []


def test_every_example_is_in_the_documents() -> None:
    docs = Path(__file__).parents[3] / "docs"
    page = (docs / "examples.md").read_text()
    for name in examples():
        assert f"## {name}\n\n{loaded(name).about}\n" in page
        assert (docs / "img" / f"{name}.png").is_file()


@pytest.mark.parametrize("name", ["crossover", "treeline"])
def test_contrast_goes_and_turns_where_an_example_says_so(name: str) -> None:
    rendering = irsim.Rendering(loaded(name))
    targets = [truth.target(rendering.follow or "") for truth in rendering.truths()]
    contrasts = [target.contrast_k for target in targets if target is not None and target.contrast_k is not None]
    assert contrasts[0] > 4
    assert min(contrasts) < -0.5


def test_occlusion_matches_the_scenario() -> None:
    scene = loaded("hiding")
    level = scene.background.surface_m
    assert level is not None
    context = scene.context
    for target in scene.targets:  # a car's place is on the level of its wheels
        below = target.path.positions(np.arange(200.0), context, target.id) @ context.geometry.down
        np.testing.assert_allclose(below, level, atol=0.01)
    for occluder in Renderer(scene).occluders[:2]:  # they stand in the picture, where the ground is as far away as they
        assert isinstance(occluder, Tree | Building)
        assert occluder.foot_px is not None
        assert 130 < occluder.foot_px[1] < 239
        below = context.geometry.place(np.array(occluder.foot_px), occluder.range_m) @ context.geometry.down
        assert below == pytest.approx(level, abs=0.1)
    truths = list(irsim.Rendering(scene).truths())
    shares = np.array([car.visible for each in truths if (car := each.target("car")) is not None], dtype=float)
    assert len(shares) == 200
    for frames, least, most in [((35, 42), 0.4, 0.52), ((66, 78), 0.0, 0.02), ((150, 165), 0.05, 0.12)]:
        part = shares[frames[0] : frames[1] + 1]
        assert least <= part.min()
        assert part.max() <= most
    assert shares[:15].min() > 0.99
    assert shares[122:132].min() > 0.99  # between the crossing and the smoke


def test_the_glare_saturates_and_blooms() -> None:
    rendering, bare = irsim.open_source("glare"), irsim.open_source("glare", without=["bloom"])
    full = 2**14 - 1
    first, second = (np.count_nonzero(source.frame(60).image == full) for source in (bare, rendering))
    assert 1 <= first < second
    sharp = irsim.open_source("glare", without=["smear"])  # by which nothing leaves the view
    target = [truth.target("rocket") for truth in sharp.truths()]
    assert all(each is not None and each.in_view for each in target)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sky", "ground"])
def test_the_demo_scene_separates_trackers(name: str, tmp_path: Path) -> None:
    """Over 30 seeds: held in at least 80 % by one shipped tracker, lost in at least 20 % by another."""
    results = run_bench([name], ["grey_pf", "template", "kalman"], results=tmp_path / "demo.db", seeds=SEEDS, jobs=2)
    lost: dict[str, int] = {}
    for cell in results.cells():
        assert cell.score is not None
        lost[cell.label] = lost.get(cell.label, 0) + bool(cell.score.lost)
    assert min(lost.values()) <= 0.2 * SEEDS
    assert max(lost.values()) >= 0.2 * SEEDS
