"""The report of an untrusted results file runs no code that it names."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import irsim
from irtrack import Entry, Results, run_bench, write_report
from irtrack.report.repeat import run_command
from irtrack.trackers.template import Template

EVIL = "named_by_a_file"

TEXT = """\
frames: 4
camera: {size: [48, 32]}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point}, path: {kind: straight, start: [10, 16], speed: 2}}]
"""


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A results file beside a module that must not be imported."""
    (tmp_path / f"{EVIL}.py").write_text("raise SystemExit('code of a file was run')")
    monkeypatch.syspath_prepend(str(tmp_path))
    path = tmp_path / "r.db"
    run_bench([irsim.Rendering(irsim.loads(TEXT), "scene")], ["template"], results=path, seeds=1).close()
    return path


def test_kind_of_a_scenario_is_not_imported(results: Path) -> None:
    with Results(results) as kept:
        (row,) = kept.sources().values()
        kept.add_source(replace(row, text=row.text.replace("kind: sky", f"kind: {EVIL}:Sky")))
    page = write_report(results).read_text()
    assert "No pictures: the source cannot be opened any more" in page
    assert "are not imported" in page
    assert EVIL not in sys.modules


def test_tracker_is_not_imported_for_its_command(results: Path) -> None:
    with Results(results) as kept:
        (cell,) = kept.cells()
        (row,) = kept.sources().values()
    config = json.dumps({**cell.config, "tracker": f"{EVIL}:Tracker"})
    named = replace(cell, key=replace(cell.key, config=config))
    assert run_command(named, replace(row, word="scene.yaml")).startswith(
        f"irtrack run {EVIL}:Tracker scene.yaml --seed 0"
    )
    assert EVIL not in sys.modules


def test_a_label_is_no_markup_in_markdown(results: Path) -> None:
    run_bench(
        [irsim.Rendering(irsim.loads(TEXT), "scene")], [Entry("<script>", Template())], results=results, seeds=1
    ).close()
    text = write_report(results, format="md").read_text()
    assert "\\<script\\>" in text
    assert not re.search(r"(?<!\\)<", text)
