"""Failing trackers: one headline, their own calls, and the exit status."""

from __future__ import annotations

import html
import json
from pathlib import Path

import pytest
from command_line import Call

from irtrack import Results


def test_failing_tracker_fails_alone(call: Call, tmp_path: Path) -> None:
    answer = call("bench", "clip.mcap", "--trackers", "template,mine:Broken", "--seeds", "1", "--results", "x.db")
    assert answer.status == 1
    assert "Traceback" not in answer.err
    assert answer.err == "irtrack: 1 of 2 runs failed; the report has the reasons\n"
    with Results(tmp_path / "x.db") as results:
        assert {(cell.label, cell.status) for cell in results.cells()} == {
            ("template", "ok"),
            ("mine:Broken", "failed"),
        }


FAILING = [
    (("mine:Broken",), "mine:Broken: frame 1: ValueError: planted", True),
    (("mine:Careless", "what=none"), "mine:Careless: frame 1: step gave None; allowed: (state, Estimate)", False),
    (("mine:Careless", "what=pair"), "mine:Careless: frame 1: step gave (state, float); allowed", False),
    (("mine:Careless", "what=leave"), "mine:Careless: frame 1: SystemExit: 3", True),
    (("mine:Careless", "what=write"), "mine:Careless: frame 1: ValueError: assignment destination is read-only", True),
]


@pytest.mark.parametrize(("words", "said", "raises"), FAILING, ids=str)
def test_failure_has_a_headline_and_the_calls(call: Call, words: tuple[str, ...], said: str, raises: bool) -> None:
    answer = call("run", words[0], "clip.mcap", *words[1:])
    assert (answer.status, answer.out) == (1, "")
    *lines, where = [line for line in answer.err.splitlines() if not line.startswith("seen")]
    assert where.startswith("on clip, seed 0; repeat it: irtrack run ")
    assert lines[0].startswith(f"irtrack: {said}")
    if not raises:
        assert len(lines) == 1
        return
    assert all(line.startswith("  ") for line in lines[1:])
    files = [line for line in lines if line.lstrip().startswith("File ")]
    assert len(files) == 1
    assert "mine.py" in files[0]
    name = words[0] + "".join(f":{word}" for word in words[1:])
    answer = call("bench", "clip.mcap", "--trackers", f"kalman,{name}", "--seeds", "1", "--results", "f.db", "--json")
    assert answer.status == 1
    assert {row["label"]: row["failed"] for row in json.loads(answer.out)["rows"]} == {"kalman": 0, name: 1}


def test_tracker_that_ends_its_process_fails_alone(call: Call, tmp_path: Path) -> None:
    trackers = "mine:Careless:what=die,kalman"
    answer = call("bench", "clip.mcap", "--trackers", trackers, "--seeds", "1", "--results", "d.db")
    assert (answer.status, answer.err) == (1, "irtrack: 1 of 2 runs failed; the report has the reasons\n")
    with Results(tmp_path / "d.db") as results:
        failures = {cell.label: cell.failure for cell in results.cells()}
    assert failures["kalman"] is None
    died = "frame 1: the process died 2 times while the tracker was at work (exit status 3)"
    assert failures["mine:Careless:what=die"] == f"clip, seed 0, {died}"


def test_error_text_is_escaped(call: Call) -> None:
    said = r"ValueError: \x1b[31m<b>red\x9b0m \x07\u202e \x00 \udc9b"
    answer = call("run", "mine:Careless", "clip.mcap", "what=command")
    assert answer.err.splitlines()[1] == f"irtrack: mine:Careless: frame 1: {said}"
    assert all(letter.isprintable() for letter in answer.err.replace("\n", ""))
    call("bench", "clip.mcap", "--trackers", "mine:Careless:what=command", "--seeds", "1", "--results", "c.db")
    call("report", "c.db", "-o", "c.html")
    assert html.escape(said) in Path("c.html").read_text(encoding="utf-8")
