"""irtrack falsify of trackers of many and of detectors: search, shrinking, report, kept failures."""

from __future__ import annotations

import json
import re
from pathlib import Path

import planted_scene_failures as planted
import pytest
from command_line import Call

import irsim
from irtrack.falsify import Failure, NoFailure, find_failure, kept_failures
from irtrack.report.finding import write_failure_report

LOWEST = {"detect": (34.0, 8), "many": (34.0, 10)}
"""Smallest failure of each task: the first severity to the right of the edge, and the frames that it takes.

Of 8 frames six are missed, more than half of a second of ten frames; the id changes in frame 9.
"""

MENDED = {"detect": "Right", "many": "RightMany"}


def kind(task: str) -> type:
    return planted.Blind if task == "detect" else planted.Switching


@pytest.fixture(params=["detect", "many"])
def found(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Failure | NoFailure, Path]:
    failure = find_failure(
        irsim.loads(planted.SCENE),
        kind(request.param)(),
        tmp_path / "out",
        search="sobol",
        fresh=5,
        name="edge",
        keep_in=tmp_path / "kept",
        report=write_failure_report,
    )
    return request.param, failure, tmp_path


def test_failure_is_found_shrunk_and_kept(found: tuple[str, Failure | NoFailure, Path]) -> None:
    task, failure, folder = found
    assert isinstance(failure, Failure)
    assert failure.repeats
    assert failure.sensitivity.is_structural
    assert failure.least.without == ("white",)
    assert (failure.least.point["targets.point.path.start.0"], failure.least.frames) == LOWEST[task]
    scene = irsim.load(folder / "out" / "minimal.yaml")
    assert [rule.kind for rule in scene.expect] == [{"detect": "pd_at_least", "many": "switches_at_most"}[task]]
    report = (folder / "out" / "report.md").read_text()
    result = {"detect": "Result: 2 of 8 positions found", "many": "Result: 1, the first at frame 9, of point"}
    assert result[task] in report
    page = (folder / "out" / "replay.html").read_text()
    assert {"detect": "pd_01", "many": "switches"}[task] in page
    assert "followed: all targets" in page
    (kept,) = kept_failures(folder / "kept")
    assert (kept.task, kept.broken, kept.changes()) == (task, True, [])
    note = json.loads(kept.note.read_text())
    kept.note.write_text(json.dumps({**note, "tracker": f"planted_scene_failures:{MENDED[task]}"}))
    (mended,) = kept_failures(folder / "kept")
    assert [line.split(": ", 1)[1].split(" no ")[1].split(",")[0] for line in mended.changes()] == [
        {"detect": "longer breaks pd_at_least (share 0.5)", "many": "longer breaks switches_at_most (count 0)"}[task]
    ]


def test_command(bare_call: Call) -> None:
    """With worker processes, then from the journal; the rules may be given as an override."""
    Path("edge.yaml").write_text(planted.SCENE)
    words = [
        "falsify",
        "edge.yaml",
        "--detector",
        "planted_scene_failures:Images",
        "--fresh",
        "5",
        "-o",
        "out",
        "--json",
    ]
    status, out, err = bare_call(*words)
    assert status == 1, err
    assert json.loads(out)["failure"]["rule"] == "raises"
    (line,) = [each for each in Path("out/report.md").read_text().splitlines() if each.startswith("- Result: ")]
    assert re.search(r"planted_scene_failures:Images: frame \d: detect gave ndarray; allowed: Detections$", line)
    assert "0 new trials" in bare_call(*words).err
    rules = "expect=[{kind: pd_at_least, share: 0.9}, {kind: false_alarms_at_most, per_frame: 0}]"
    words = ["falsify", "edge.yaml", rules, "frames=5", "--detector", "planted_scene_failures:Right"]
    status, out, _ = bare_call(*words, "--budget", "2", "-o", "none")
    assert status == 0
    assert "breaks no rule in 2 runs; the least margin is 0" in out


def test_exception_of_a_tracker_of_many(tmp_path: Path) -> None:
    found = find_failure(irsim.loads(planted.SCENE), planted.Doubling(), tmp_path, fresh=5)
    assert isinstance(found, Failure)
    assert (found.rule, found.run, found.least.frames) == ("raises", 0, 4)


@pytest.mark.parametrize("words", [[], ["--tracker", "gnn", "--detector", "dog"], ["--detector", "dog,tophat"]])
def test_one_tracker_or_one_detector(bare_call: Call, words: list[str]) -> None:
    Path("edge.yaml").write_text(planted.SCENE)
    status, out, err = bare_call("falsify", "edge.yaml", *words)
    assert (status, out) == (2, "")
    assert err == "irtrack: --tracker: allowed: one tracker, or one --detector in its place\n"


def test_run_prints_the_rules_of_its_task(bare_call: Call) -> None:
    Path("edge.yaml").write_text(planted.SCENE + "expect: [{kind: switches_at_most}, {kind: never_lost}]")
    out = bare_call("run", "planted_scene_failures:Switching", "edge.yaml", "targets.point.path.start.0=40").out
    assert "broken       no more identity switches than 0: 1, the first at frame 9, of point" in out
    assert "in a row off" not in out
