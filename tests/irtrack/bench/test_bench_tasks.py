"""Bench of detectors and of trackers of many: results, keys, tables, report, commands."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Call

import irtrack
from irtrack.bench.plan import Seeds, plans, tracker_specs
from irtrack.bench.spec import parse_detectors, parse_trackers
from irtrack.bench.task_summary import task_summary
from irtrack.metrics.tasks import FIGURES_OF
from irtrack.tracks import TrackSet

SCENE = """
seed: 3
frames: 24
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, scr: 30}, path: {kind: straight, start: [20, 30], speed: 1, range_m: 3000}}
  - {id: b, shape: {kind: point, scr: 30}, path: {kind: straight, start: [20, 50], speed: 1.2, range_m: 3000}}
"""
WORDS = ("bench", "two.yaml", "--trackers", "gnn:detector=dog,kalman", "--detectors", "tophat,dog", "--seeds", "2")


@pytest.fixture
def two(bare_call: Call) -> Call:
    """The command irtrack in a folder with a scene of two points, and one without a target."""
    Path("two.yaml").write_text(SCENE)
    Path("empty.yaml").write_text(SCENE.partition("targets:")[0])
    return bare_call


def test_tasks_in_one_bench(two: Call) -> None:
    """Each tracker and detector has its task; the second call runs nothing; the report has all."""
    answer = two(*WORDS, "--input", "counts", "--json")
    assert answer.status == 0, answer.err
    rows = {row["label"]: row for row in json.loads(answer.out)["rows"]}
    assert rows["kalman"]["lost"] == 0
    many, dog = rows["gnn:detector=dog"], rows["dog"]
    assert (many["task"], dog["task"]) == ("many", "detect")
    assert set(many["figures"]) == set(FIGURES_OF["many"])
    assert many["figures"]["found"]["mean"] == 1
    assert dog["figures"]["pd"]["mean"] > 0.9
    ceiling = rows["matched_filter_ideal"]
    assert (ceiling["task"], ceiling["rank"], dog["rank"] + rows["tophat"]["rank"]) == ("detect", 0, 3)
    assert ceiling["figures"]["pd_01"]["mean"] >= dog["figures"]["pd_01"]["mean"]
    assert ceiling["figures"]["pd"] is None
    with irtrack.Results("irtrack.db") as results:
        kept = {cell.label: cell for cell in results.cells()}
        again = results.cells()
    assert len(again) == 10
    assert kept["dog"].key.start == "none"
    assert "matched_filter_ideal needs truth: a ceiling, not a detector" in two(*WORDS, "--input", "counts").out
    with irtrack.Results("irtrack.db") as results:
        assert [cell.outcome for cell in results.cells()] == [cell.outcome for cell in again]
        arrays = results.arrays(kept["gnn:detector=dog"].key)
    assert arrays is not None
    assert {"frame", "id", "cx", "matches", "names"} <= set(arrays)
    assert two("report", "irtrack.db", "-o", "r.html").status == 0
    page = Path("r.html").read_text()
    assert "Identities over time" in page
    assert "Probability of detection against false alarms" in page
    assert "matched_filter_ideal needs truth: a ceiling, not a detector" in page
    assert two("export", "irtrack.db", "-o", "r.csv").status == 0
    with Path("r.csv").open(newline="") as file:
        table = {row["label"]: row for row in csv.DictReader(file)}
    assert float(table["dog"]["pd"]) > 0.9
    assert table["dog"]["hota"] == table["kalman"]["pd"] == ""


def test_scenes_without_targets_count_false_alarms(two: Call) -> None:
    answer = two("bench", "empty.yaml", "--trackers", "gnn", "--detectors", "tophat", "--seeds", "1", "--json")
    assert answer.status == 0, answer.err
    rows = {row["task"]: row["figures"] for row in json.loads(answer.out)["rows"]}
    assert rows["many"]["false_tracks_min"]["mean"] >= 0
    assert rows["detect"]["false_alarms"]["mean"] >= 0
    assert rows["many"]["mota"] is rows["detect"]["pd"] is None


def test_run_of_many_writes_tracks(two: Call) -> None:
    answer = two("run", "gnn", "two.yaml", "detector=dog", "--input", "counts", "--csv", "t.csv")
    assert answer.status == 0, answer.err
    lines = answer.out.splitlines()
    assert lines[0].startswith("gnn on two: ")
    assert "confirmed track" in lines[0]
    assert any(line.startswith("hota ") for line in lines)
    with Path("t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["status"] for row in rows} <= {"tracking", "occluded"}
    assert two("run", "gnn", "two.yaml", "detector=dog", "--input", "counts", "--csv", "t.txt").status == 0
    first = Path("t.txt").read_text().splitlines()[0].split(",")
    assert len(first) == 10
    assert int(first[0]) >= 1
    value = json.loads(two("run", "gnn", "two.yaml", "--json").out)
    assert set(value["score"]) == set(FIGURES_OF["many"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("run", "gnn", "two.yaml", "--init", "5,5,9,9"), "--init: gnn follows all targets without a box; allowed: "),
        (
            ("run", "tophat", "two.yaml", "-o", "t.mcap"),
            "-o: tophat is a detector, which has no tracks; allowed: ",
        ),
        (("run", "tophat", "two.yaml", "--start", "auto"), "--start: tophat follows all targets without a box"),
        (("run", "gnn:detections=d.csv:detector=dog", "two.yaml"), "detector and detections; allowed: one of them"),
        (("run", "gnn:detections=none.csv", "two.yaml"), "none.csv: there is no such file"),
        (("run", "gnn:detector=tophatt", "two.yaml"), "did you mean 'tophat'?"),
        (("run", "kalman", "two.yaml", "--start", "now"), "--start now: allowed: auto, or auto:DETECTOR"),
        (("run", "kalman", "two.yaml", "--start", "auto", "--target", "a"), "--start auto: finds its own target"),
        (("run", "kalman", "empty.yaml", "--start", "auto:threshold"), "gives no confirmed track in 24 frames"),
        (("bench", "two.yaml", "--detectors", "tophat:radios=3", "--results", "x.db"), "did you mean 'radius'?"),
        (("bench", "two.yaml", "--detectors", "kalman", "--results", "x.db"), "unknown detector 'kalman'"),
        (("bench", "two.yaml", "--results", "x.db"), "or --detectors"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_bad_input_is_one_line(two: Call, words: tuple[str, ...], said: str) -> None:
    answer = two(*words)
    assert (answer.status, answer.out, answer.err.count("\n")) == (2, "", 1), answer.err
    assert said in answer.err


def test_automatic_start(two: Call) -> None:
    answer = two("run", "kalman", "two.yaml", "--start", "auto:dog", "--input", "counts", "--json")
    assert answer.status == 0, answer.err
    value = json.loads(answer.out)
    assert value["target"] in ("a", "b")
    assert value["score"]["lost"] is False
    bench = two(
        "bench",
        "two.yaml",
        "--trackers",
        "kalman",
        "--start",
        "auto:dog",
        "--seeds",
        "1",
        "--json",
        "--input",
        "counts",
    )
    assert json.loads(bench.out)["rows"][0]["lost"] == 0


def test_another_weight_file_is_another_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "weighed.py").write_text(
        "class Net:\n    weights = 'net.bin'\n    def detect(self, image):\n        return []\n"
    )
    monkeypatch.chdir(tmp_path)

    def key() -> str:
        (spec,) = tracker_specs(parse_detectors("weighed:Net"))
        (plan,) = plans(["sky"], [spec], Seeds([0]), "display", None, None)
        return plan.group.members[0].key.digest

    with pytest.raises(irtrack.InputError, match=r"weights net\.bin: there is no such file"):
        key()
    (tmp_path / "net.bin").write_bytes(b"one")
    first = key()
    (tmp_path / "net.bin").write_bytes(b"two")
    assert key() != first


def test_detector_of_a_tracker_belongs_to_its_key() -> None:
    specs = tracker_specs(parse_trackers("a=gnn:detector=tophat,b=gnn:detector=dog"))
    assert specs[0].config != specs[1].config
    assert specs[0].weights != specs[1].weights


def test_ranks_need_enough_runs(two: Call) -> None:
    two(*WORDS, "--input", "counts")
    with irtrack.Results("irtrack.db") as results:
        rows = [row for row in task_summary(results.cells()) if row.task == "detect"]
    assert [row.rank for row in rows] == [0, 1, 2]
    assert rows[2].standing == "too few"


def test_track_set_of_python_code() -> None:
    found = irtrack.run_many("gnn", "sky", frames=3)
    assert isinstance(found, TrackSet)
    assert found.frames.tolist() == [0, 1, 2]
    assert np.isfinite(found.step_ms).all()
