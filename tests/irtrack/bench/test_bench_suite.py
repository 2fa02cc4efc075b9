"""Suites: their runs, and errors with places; repeats and ties."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_fakes import Strip, Walker
from bench_rows import rows

import irsim
import irtrack
from irtrack.bench import Entry, RunRecord, SourceEntry, load_suite, run_bench, summary
from irtrack.bench.plan import APART
from irtrack.bench.suite import SuiteFile
from irtrack.errors import InputError

SCENE = """
frames: 4
camera: {size: [48, 32]}
severities: {camera.netd_mk: [10, 50, 90]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [20, 16], range_m: 1500}}
  - {id: bird, shape: {kind: point, temperature_k: 400}, path: {kind: straight, start: [30, 20], range_m: 3000}}
"""
SUITE = """about: of every sort
sources:
  - {source: scene.yaml, severities: [0, 2], changes: {frames: 3}, target: bird}
  - {source: scene.yaml, name: plain}
trackers:
  - big=grey_pf:particles=40
  - {tracker: grey_pf, label: small, parameters: {particles: 20}}
seeds: 2
tracker_seeds: 2
input: counts
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "suites").mkdir()
    (tmp_path / "suites" / "scene.yaml").write_text(SCENE)
    return tmp_path


def written(folder: Path, text: str) -> Path:
    path = folder / "suites" / "my-suite.yaml"
    path.write_text(text)
    return path


def test_suite_runs_its_entries(folder: Path) -> None:
    suite = load_suite(written(folder, SUITE))
    assert suite.about == "of every sort"
    seeds: dict[str, Any] = {"seeds": suite.seeds, "tracker_seeds": suite.tracker_seeds, "input": suite.input}
    with run_bench(suite.sources, suite.trackers, results=folder / "r.db", **seeds) as results:
        cells, sources = results.cells(), results.sources()
    assert len(cells) == 3 * 2 * 2 * 2
    assert {(cell.source, cell.family, cell.severity, cell.key.target) for cell in cells} == {
        ("scene@0", "scene", 0, "bird"),
        ("scene@2", "scene", 2, "bird"),
        ("plain", "plain", 0, "jet"),
    }
    assert {cell.label: cell.config["parameters"]["particles"] for cell in cells} == {"big": 40, "small": 20}
    assert {cell.key.input for cell in cells} == {"counts"}
    assert {(cell.key.scene_seed, cell.key.tracker_seed) for cell in cells} == {
        (0, 0), (0, APART), (1, 1), (1, 1 + APART),
    }  # fmt: skip
    for (name, _), row in sources.items():
        scenario = irsim.load(row.word, row.changes)  # what the report's commands name
        assert scenario.model_copy(update={"seed": 0}).hash == row.scene_hash
        if name.startswith("scene@"):
            assert scenario.camera.netd_mk == {0: 10, 2: 90}[row.severity or 0]
            assert row.length == 3


@pytest.mark.parametrize(
    ("change", "place", "what"),
    [
        (("seeds: 2", "sedes: 2"), "8:1", "sedes: unknown key; allowed: about, sources, .*did you mean 'seeds'"),
        (("target: bird", "taget: bird"), "3:68", r"sources\.0\.taget: unknown key.*did you mean 'target'"),
        (("scene.yaml, name", "absent.yaml, name"), "4:5", r"sources\.1: absent\.yaml: cannot read it"),
        (("frames: 3", "frame: 3"), "3:5", r"sources\.0: override frame: unknown key.*did you mean 'frames'"),
        (("[0, 2]", "[0, 3]"), "3:5", r"sources\.0: scene: severity 3: allowed: 0 to 2"),
        (("big=grey_pf", "big=gray_pf"), "6:5", r"trackers\.0: unknown tracker 'gray_pf'.*did you mean 'grey_pf'"),
        (("particles: 20", "partikles: 20"), "7:5", r"trackers\.1: grey_pf: partikles: unknown key"),
        ((SUITE, "sources: [sky]\n"), "1:1", "trackers: it is missing"),
    ],
)
def test_errors_of_a_suite_have_places(folder: Path, change: tuple[str, str], place: str, what: str) -> None:
    assert change[0] in SUITE
    path = written(folder, SUITE.replace(*change))
    with pytest.raises(InputError, match=what) as caught:
        load_suite(path)
    assert str(caught.value).startswith(f"{path}:{place}: ")


def test_all_errors_of_a_suite_at_once(folder: Path) -> None:
    path = written(folder, SUITE.replace("[0, 2]", "[7]").replace("name: plain", "target: x").replace("big=grey", "g"))
    with pytest.raises(InputError) as caught:
        load_suite(path)
    lines = str(caught.value).splitlines()
    assert [line.removeprefix(f"{path}:").split(": ")[0] for line in lines] == ["3:5", "6:5"]


def test_shipped_suites() -> None:
    scenarios = Path(__file__).parents[3] / "scenarios"
    shipped = {path.stem: irsim.read_part(path, SuiteFile).part for path in (scenarios / "suites").glob("*.yaml")}
    assert set(shipped) == {"quick-suite", "hard-suite", "stress-suite", "occlusion-suite"}
    for suite in shipped.values():
        assert suite.about
        assert suite.time_limit_s
        for source in suite.sources:
            assert irsim.load(source.source).severities or not source.severities
        for tracker in suite.trackers:
            irtrack.make(tracker.tracker, tracker.parameters)
    stress = {f"stress/{path.stem}": path.read_text() for path in (scenarios / "stress").glob("*.yaml")}
    every = {name for name, text in stress.items() if "severities:" in text}
    in_parts = {"stress/occlusion-length", "stress/occlusion-fraction"}
    assert {source.source for source in shipped["stress-suite"].sources} == every - in_parts
    assert load_suite("suites/quick-suite").seeds == shipped["quick-suite"].seeds


def test_sources_at_severities(folder: Path) -> None:
    with pytest.raises(InputError, match="sky: it has no severities"):
        run_bench([SourceEntry("sky", severities="all")], ["kalman"], results=folder / "r.db")
    with pytest.raises(InputError, match="two sources are named 'strip'"):
        run_bench([Strip(), Strip()], ["kalman"], results=folder / "r.db")
    value = irsim.loads(SCENE)
    with run_bench([SourceEntry(value, severities="all")], ["kalman"], results=folder / "r.db") as results:
        assert [cell.severity for cell in results.cells()] == [0, 1, 2]
        assert len({cell.key.source_hash for cell in results.cells()}) == 3


# -- repeats and ties


def test_repeats_of_one_run_count_once(tmp_path: Path) -> None:
    entries = [Entry("same", Walker()), Entry("drawn", Walker(jitter=1.0))]
    with run_bench([Strip()], entries, seeds=2, tracker_seeds=3, results=tmp_path / "r.db") as results:
        found = {row.label: row for row in summary(results.cells())}
        assert len(rows(results)) == 12
    assert (found["same"].runs, found["same"].repeats, found["same"].scored) == (1, 5, 1)
    assert (found["drawn"].runs, found["drawn"].repeats) == (6, 0)
    assert (found["same"].compared, found["drawn"].compared) == (1, 6)  # all of one scene, all are compared


def test_tie_by_paired_difference(tmp_path: Path) -> None:
    """On 12 scenes that differ: b is off by 0.1 px more or less than a by turns; c by 2 px more than either."""
    rng = np.random.default_rng(0)
    cells: list[RunRecord] = []
    with run_bench([Strip()], [Entry("x", Walker())], results=tmp_path / "r.db") as results:
        (cell,) = results.cells()
    assert cell.score is not None
    base = cell.score.as_dict()
    for scene in range(12):
        error = 1 + rng.random()
        for label, more in (("a", 0.0), ("b", 0.1 * (-1) ** scene + 0.001), ("c", 2.0)):
            score = type(cell.score).from_dict(base | {"error_held": error + more})
            key = cell.key.__class__(
                str(scene), "a", "visible", "display", scene, scene, json.dumps({"tracker": label}), ""
            )
            cells.append(RunRecord(key, label, "s", "s", "ok", score=score))
    assert [(row.label, row.standing) for row in summary(cells)] == [("a", "told"), ("b", "tie"), ("c", "told")]
    few = [cell for cell in cells if int(cell.key.source_hash) < 5]
    assert [row.standing for row in summary(few)] == ["told", "too few", "too few"]
