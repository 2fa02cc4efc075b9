"""Lost runs by severity: a table for each tracker, in the page and in Markdown."""

from __future__ import annotations

from pathlib import Path

import pytest
from html_page import Page

import irsim
from irtrack.bench import Results, SourceEntry, parse_trackers, run_bench
from irtrack.report import write_report

SCENE = """
frames: 14
camera: {size: [128, 48], agc: {kind: fixed}, range_k: [250, 350]}
severities: {targets.jet.path.speed: [0, 1, 3]}
background: {kind: sky, horizon_k: 270, zenith_k: 268}
targets:
  - id: jet
    shape: {kind: point, temperature_k: 400, area_m2: 1}
    path: {kind: straight, start: [12, 20], range_m: 900}
"""
HEAD = ["Source", "0", "1", "2", "Half lost at"]
LONG, SOME = ["0 %", "100 %", "100 %"], ["0 %", "–", "100 %"]
"""A stationary estimate is off from 5 px on, and lost after 10 frames off: at 1 px a frame within 40 frames but not
within 14, at 3 px a frame within both."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("severities")
    scene = irsim.loads(SCENE)
    sources = [
        SourceEntry(irsim.change(scene, {"frames": 40}), severities="all", name="long"),
        SourceEntry(scene, severities=[0, 2], name="some"),
    ]
    return run_bench(sources, parse_trackers("still=report_fakes:Still"), results=folder / "r.db", seeds=1)


def test_page_has_a_table_for_each_tracker(results: Results, tmp_path: Path) -> None:
    page = Page(write_report(results, tmp_path / "report.html").read_text())
    (still,) = (table for table in page.tables if table[0] == HEAD)
    assert [[row[0], *row[1:4]] for row in still[1:]] == [["long", *LONG], ["some", *SOME]]
    assert "#severities" in page.links


def test_markdown_has_the_same_tables(results: Results, tmp_path: Path) -> None:
    text = write_report(results, tmp_path / "report.md").read_text()
    table = text.split("## Lost runs by severity: still\n\n")[1].split("\n\n")[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    assert cells[0] == ["source", "0", "1", "2", "half lost at"]
    assert [row[:4] for row in cells[2:]] == [["long", *LONG], ["some", *SOME]]
    heads = [line for line in text.splitlines() if line.startswith("## ")]
    assert heads[:3] == ["## All sources", "## Breaking points", "## Lost runs by severity: still"]
    assert len(heads) == 3 + 5  # sources at their severities
