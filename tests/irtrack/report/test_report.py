"""The report: one offline page with the scores, and commands that repeat them."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from html_page import Page

import irsim
from irsim.types import Box
from irtrack import InputError, Results, run_bench, write_report
from irtrack.bench import RunRecord, parse_trackers
from irtrack.cli import main
from irtrack.metrics import Trace
from irtrack.report.repeat import run_command

SCENE = """
frames: 26
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - id: jet
    shape: {kind: fighter}
    path: {kind: straight, start: [20, 36], speed: 2.8, range_m: 3000}
occluders:
  - {kind: bar, id: pole, center_px: [40, 36], size_px: [12, 60], range_m: 500, temperature_k: 280}
"""
COMMAND = "irtrack bench 'sky <1>.yaml' clip.mcap --trackers grey_pf:particles=20,still=..."


@dataclass
class Measured:
    """A small bench: its folder, results file and page."""

    folder: Path
    results: Path
    html: str
    page: Page
    cells: list[RunRecord] = field(default_factory=list)
    traces: list[Trace | None] = field(default_factory=list)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    folder = tmp_path_factory.mktemp("report")
    (folder / "sky <1>.yaml").write_text(SCENE)
    irsim.record(irsim.open_source(folder / "sky <1>.yaml"), folder / "clip.mcap")
    entries = [
        *parse_trackers("grey_pf:particles=20"),
        *parse_trackers("still=report_fakes:Still,broken=report_fakes:Still:raise_at=5"),
    ]
    sources = [folder / "sky <1>.yaml", folder / "clip.mcap"]
    with run_bench(sources, entries, results=folder / "bench.db", seeds=2, command=COMMAND) as results:
        html = write_report(results).read_text()
        cells = results.cells()
        return Measured(folder, results.path, html, Page(html), cells, [results.trace(cell.key) for cell in cells])


def ranked(page: Page) -> list[list[list[str]]]:
    """Return the ranked tables: over all sources, and of each."""
    return [table for table in page.tables if "Runs" in table[0]]


def test_report_is_one_file_beside_the_results(measured: Measured) -> None:
    names = sorted(path.name for path in measured.folder.iterdir())
    assert names == ["bench.db", "clip.mcap", "report.html", "sky <1>.yaml"]


def test_page_is_offline(measured: Measured) -> None:
    assert measured.page.links
    assert all(link.startswith(("#", "data:")) for link in measured.page.links)
    assert not re.findall(r"url\((?!#)|@import", measured.html)
    assert not {"link", "iframe", "object"} & set(measured.page.tags)
    assert not re.findall(r"<script[^>]*\bsrc", measured.html)
    assert "default-src 'none'" in measured.html


def test_links_have_targets_and_ids_are_unique(measured: Measured) -> None:
    ids = re.findall(r'\bid="([^"]*)"', measured.html)
    assert len(ids) == len(set(ids))
    wanted = {link[1:] for link in measured.page.links if link.startswith("#")}
    wanted |= set(re.findall(r"url\(#([^)]*)\)", measured.html))
    assert wanted <= set(ids)


def test_page_has_every_tracker_and_source(measured: Measured) -> None:
    assert len(ranked(measured.page)) == 3  # all sources, and each of the two
    for table in ranked(measured.page):
        assert {row[1] for row in table[2:]} == {"grey_pf:particles=20", "still", "broken"}
    assert "sky <1>" in measured.page.text
    assert "sky <1>" not in measured.html  # escaped
    # Two sources, six frames, two pictures each; and each tracker's first loss on each source.
    lost = {(cell.label, cell.source) for cell in measured.cells if cell.score and cell.score.lost}
    assert ("still", "clip") in lost
    assert measured.html.count('<svg class="whole"') == 2 * 6
    assert measured.html.count('<svg class="crop"') == 2 * 6 + len(lost)


def test_numbers_are_the_scores(measured: Measured) -> None:
    """Against the tracks, by the definitions on the page."""
    clip = ranked(measured.page)[1]
    row = next(row for row in clip if row[1] == "still")
    pairs = zip(measured.cells, measured.traces, strict=True)
    traces = [trace for cell, trace in pairs if cell.label == "still" and cell.source == "clip" and trace]
    assert len({trace.digest for trace in traces}) == 1  # without random numbers: one run, and its repeat
    del traces[1:]
    held_x: list[float] = []
    squares: list[float] = []
    lost, near = 0, []
    for trace in traces:
        offsets = trace.centers - trace.truth_centers
        distance = np.hypot(*offsets.T)
        limit = np.maximum(5, np.hypot(*trace.truth_sizes.T))
        row_of_off: list[int] = []
        lost_at = len(distance)
        for place in range(1, len(distance)):
            if trace.visible[place] < 0.5:
                continue
            row_of_off = [*row_of_off, place] if distance[place] > limit[place] else []
            if len(row_of_off) == 10 and lost_at == len(distance):
                lost_at = row_of_off[0]
        lost += lost_at < len(distance)
        held_x += np.abs(offsets[1:lost_at, 0]).tolist()
        squares += (distance[1:lost_at] ** 2).tolist()
        near.append(float(np.mean(distance[1:] <= 5)))
    assert lost == 1  # the test needs a loss
    text = " ".join(row[3].split())
    assert text.startswith("100 % 1 of 1")
    assert row[4].replace("\xa0", " ") == f"{np.mean(held_x):.2f} ± {np.std(held_x):.2f}"
    assert row[6] == f"{np.sqrt(np.mean(squares)):.2f}"
    assert row[8] == f"{np.mean(near):.3f}"


def test_failed_runs_and_their_errors_are_shown(measured: Measured) -> None:
    row = next(row for row in measured.page.tables[0] if row[1] == "broken")
    assert "3 failed" in row[2]  # two scenes, and the recording, which is the same for each seed
    assert row[3:] == ["–"] * 10
    assert "ValueError: a fault <planted> here" in measured.page.text
    assert "Traceback (most recent call last)" in measured.page.text
    assert "3 runs failed" in measured.page.text


def test_commands_of_the_page_repeat_the_scores(
    measured: Measured, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = [shlex.split(line) for line in measured.page.commands]
    sky, clip = measured.folder / "sky <1>.yaml", measured.folder / "clip.mcap"
    assert COMMAND in measured.page.commands
    assert ["irsim", "render", str(sky), "--seed", "0", "-o", "sky <1>-0.mcap"] in commands
    runs = [words for words in commands if words[:3] == ["irtrack", "run", "grey_pf"]]
    assert {words[3] for words in runs} == {str(sky), str(clip)}
    monkeypatch.chdir(measured.folder)
    for words in runs:
        monkeypatch.setattr("sys.argv", [*words, "--json"])
        with pytest.raises(SystemExit) as ended:
            main()
        assert not ended.value.code
        again = json.loads(capsys.readouterr().out)
        assert again["config"]["parameters"]["particles"] == 20
        wanted = next(
            cell
            for cell in measured.cells
            if cell.source == again["source"]
            and cell.label.startswith("grey_pf")
            and cell.key.tracker_seed == int(words[words.index("--seed") + 1])
        )
        assert wanted.score is not None
        figures = wanted.score.as_dict()
        assert {k: v for k, v in again["score"].items() if "ms_" not in k} == {
            k: v for k, v in figures.items() if "ms_" not in k
        }


def test_changed_or_missing_recording_has_no_pictures(measured: Measured, tmp_path: Path) -> None:
    clip = tmp_path / "clip.mcap"
    clip.write_bytes((measured.folder / "clip.mcap").read_bytes())
    with run_bench([clip], ["template"], results=tmp_path / "r.db") as results:
        irsim.record(irsim.open_source(measured.folder / "sky <1>.yaml", seed=9), clip)
        assert "is not the recording that was measured" in Page(write_report(results).read_text()).text
        clip.unlink()
        assert "No pictures: the source cannot be opened any more" in Page(write_report(results).read_text()).text


def test_without_truth_pictures_but_no_scores(measured: Measured, tmp_path: Path) -> None:
    start = (Box(20, 36, 16, 8), 2)
    arguments: Any = {"results": tmp_path / "blind.db", "init": start}
    with run_bench([measured.folder / "clip.mcap"], ["grey_pf"], **arguments) as results:
        page = Page(write_report(results, tmp_path / "blind.html").read_text())
        cell = results.cells()[0]
        (row,) = results.sources().values()
    assert "called from Python" in page.text
    assert "No scores" in page.text
    assert "No run could be scored" in page.text
    assert page.tags.count("image") == 12
    assert page.tags.count("canvas") == 2
    assert "centre error, px" not in page.text
    # Pixels 12.5 .. 27.5 across and 32.5 .. 39.5 down, as a label file writes them.
    assert "--init 12.5,32.5,16,8@2" in run_command(cell, row)


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Results]:
    with Results(tmp_path / "empty.db", create=True) as results:
        yield results


def test_empty_results_are_an_input_error(empty: Results, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"empty\.db: holds no finished run"):
        write_report(empty)
    assert [path.name for path in tmp_path.iterdir()] == ["empty.db"]
