"""Output of `irtrack list`, `run`, `bench` and `report`."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from bench_fakes import Strip, Walker
from command_line import Call

import irsim
import irtrack
from irtrack.cli.output import print_run
from irtrack.registry.table import TRACKERS


def test_list_names_every_tracker(call: Call) -> None:
    answer = call("list")
    assert answer.status == 0
    assert {line.split()[0] for line in answer.out.splitlines() if line[0] != " "} >= set(TRACKERS)
    rows = json.loads(call("list", "--json").out)
    assert {row["name"] for row in rows} >= set(TRACKERS)


@pytest.mark.parametrize(
    ("visible", "line"),
    [
        ((1.0,) * 8, "no"),
        (
            (1.0, 1.0, 1.0, 0.2, 0.2, 1.0, 1.0, 1.0),
            "no (judged on 5 of these frames; more than half hidden in the other 2)",
        ),
    ],
)
def test_run_prints_the_frames_that_judge_a_loss(
    visible: tuple[float, ...], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    strip = Strip(visible=visible)
    track = irtrack.run(Walker(), strip)
    print_run(track, irtrack.score(track, strip), True)
    printed = capsys.readouterr().out.splitlines()
    assert printed[1:3] == ["scored       7 of 7 frames", f"lost         {line}"]


def test_source_label(call: Call, tmp_path: Path) -> None:
    answer = call("bench", "clip.mcap", "AGAIN=clip.mcap", "--trackers", "kalman", "--seeds", "1", "--results", "a.db")
    assert answer.status == 0, answer.err
    assert [line.split()[0] for line in answer.out.splitlines()[1:3]] == ["AGAIN", "clip"]
    assert call("report", "a.db", "-o", "a.html").status == 0


def test_run_prints_scores_and_a_repeat_command(call: Call) -> None:
    first = call("run", "grey_pf", "scene.yaml", "particles=30")
    assert (first.status, first.err) == (0, "")
    lines = first.out.splitlines()
    assert lines[0] == "grey_pf on scene: jet, frames 0 to 19, seed 3"  # the scenario's own seed
    assert lines[-1] == "repeat it: irtrack run grey_pf scene.yaml particles=30 --seed 3"
    again = call(*lines[-1].removeprefix("repeat it: irtrack ").split())
    assert [line for line in again.out.splitlines() if not line.startswith("time")][:-1] == [
        line for line in lines if not line.startswith("time")
    ][:-1]


def test_run_explains_the_expected_rules(call: Call) -> None:
    rules = "expect=[{kind: error_below, px: 0.001}, {kind: never_lost}, {kind: never_lost, target: jet}]"
    answer = call("run", "template", "scene.yaml", rules)
    assert answer.status == 0
    explained = [line.split(maxsplit=1) for line in answer.out.splitlines() if line.startswith(("held ", "broken "))]
    assert [verdict for verdict, _ in explained] == ["broken", "held", "held"]
    assert explained[0][1].startswith("a centre error of at most 0.001 px in every frame: ")
    found = json.loads(call("run", "template", "scene.yaml", rules, "--json").out)["expected"]
    assert [each["margin"] < 0 for each in found] == [True, False, False]
    assert "held " not in call("run", "template", "scene.yaml").out  # no rules


def test_run_as_json_is_one_document(call: Call) -> None:
    answer = call(
        "run", "grey_pf", "scene.yaml", "particles=30", "frames=8", "--target", "bird", "--json", "--seed", "5"
    )
    assert (answer.status, answer.err) == (0, "")
    value = json.loads(answer.out)
    assert len(value["frames"]) == 8  # the scenario's key
    assert value["config"]["parameters"]["particles"] == 30  # the tracker's
    assert (value["target"], value["scene_seed"], value["tracker_seed"]) == ("bird", 5, 5)
    assert value["score"]["frames"] == 7  # the start frame is not scored
    assert value["repeat"].startswith("irtrack run grey_pf scene.yaml particles=30")


def test_run_of_a_recording_equals_run_of_its_scene(call: Call) -> None:
    scene = json.loads(call("run", "kalman", "scene.yaml", "--json").out)
    clip = json.loads(call("run", "kalman", "clip.mcap", "--json", "--seed", "3").out)
    assert clip["scene_seed"] is None
    for one, other in zip(scene["frames"], clip["frames"], strict=True):
        assert {**one, "ms": 0} == {**other, "ms": 0}


def test_run_writes_the_track(call: Call, tmp_path: Path) -> None:
    answer = call("run", "grey_pf", "clip.mcap", "-o", "track.mcap", "--csv", "track.csv", "--json")
    assert answer.status == 0
    frames = json.loads(answer.out)["frames"]
    track = irsim.read_tracks(tmp_path / "track.mcap")
    assert (track.header.tracker, track.header.target, track.header.source) == ("grey_pf", "jet", "clip")
    assert [state.box.cx for state in track.states] == [row["cx"] for row in frames]
    assert [state.status for state in track.states] == [row["status"] for row in frames]
    assert [state.neff for state in track.states] == [row["neff"] for row in frames]
    assert track.states[1].covariance is not None
    with (tmp_path / "track.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["cx"]) for row in rows] == [row["cx"] for row in frames]


def test_run_from_a_given_box_has_no_scores(call: Call) -> None:
    answer = call("run", "template", "clip.mcap", "--init", "25,32,12,8@4")
    assert answer.status == 0
    assert "a given box, frames 4 to 19" in answer.out
    assert "no scores: a box was given without a target; --target ID names it" in answer.out
    named = call("run", "template", "clip.mcap", "--init", "25,32,12,8@4", "--target", "jet")
    assert "rmse" in named.out
    last = call("run", "template", "clip.mcap", "--init", "25,32,12,8@19", "--target", "jet")
    assert "no scores: there is no frame after the start" in last.out
    value = json.loads(call("run", "template", "clip.mcap", "--init", "25,32,12,8@4", "--json").out)
    assert value["start"] == {"frame": 4, "cx": 30.5, "cy": 35.5, "w": 12, "h": 8}
    assert value["score"]["rmse"] is None


def test_bench_and_report(call: Call, tmp_path: Path) -> None:
    words = ("bench", "scene.yaml", "clip.mcap", "--trackers", "grey_pf,few=grey_pf:particles=20", "--seeds", "2")
    answer = call(*words)
    assert (answer.status, answer.err) == (0, "")
    table = [line.split()[:4] for line in answer.out.splitlines()[1:5]]
    assert sorted((row[0], row[2], row[3]) for row in table) == [
        (source, label, "2") for source in ("clip", "scene") for label in ("few", "grey_pf")
    ]
    assert answer.out.splitlines()[-1] == "results: irtrack.db    next: irtrack report irtrack.db"
    value = json.loads(call(*words, "--json").out)
    assert value["results"] == "irtrack.db"
    assert {(row["source"], row["label"], row["runs"]) for row in value["rows"]} == {
        (source, label, 2) for source in ("clip", "scene") for label in ("few", "grey_pf")
    }
    # Only the runs of this call.
    part = json.loads(call("bench", "clip.mcap", "--trackers", "grey_pf", "--seeds", "1", "--json").out)
    assert [(row["source"], row["label"], row["runs"]) for row in part["rows"]] == [("clip", "grey_pf", 1)]
    written = call("report", "irtrack.db")
    assert (written.status, written.out) == (0, "report.html\n")
    assert (tmp_path / "report.html").stat().st_size > 10_000
    assert call("report", "irtrack.db", "-o", "other.html").out == "other.html\n"


def test_bench_overrides_scenario_keys(call: Call) -> None:
    changes = ("frames=8", "targets.jet.path.speed=2")
    words = ("bench", "a=scene.yaml", "scene.yaml", *changes, "--trackers", "kalman", "--seeds", "1", "--json")
    assert {row["source"] for row in json.loads(call(*words).out)["rows"]} == {"a", "scene"}
    changed = irsim.load("scene.yaml", [*changes, "seed=0"])
    with irtrack.Results("irtrack.db") as results:
        kept = {(row.hash, row.length, row.changes) for row in results.sources().values()}
    assert kept == {(changed.hash, 8, changes)}


def test_run_takes_parameters_after_the_name(call: Call) -> None:
    words = ("run", "big=grey_pf:particles=40:bins=8", "clip.mcap", "alpha=0.5", "--json")
    track = json.loads(call(*words).out)
    assert (track["tracker"], track["config"]["tracker"]) == ("big", "grey_pf")
    assert {key: track["config"]["parameters"][key] for key in ("particles", "bins", "alpha")} == {
        "particles": 40,
        "bins": 8,
        "alpha": 0.5,
    }
