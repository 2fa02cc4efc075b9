"""Report of trackers of many targets and of detectors: breaking points, switches, replays, conditions."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

import irtrack
from irtrack.bench.spec import parse_detectors
from irtrack.bench.task_summary import task_breaking
from irtrack.metrics.multiple import NOBODY
from irtrack.report.line_styles import styles
from irtrack.report.task_figures import bootstrap, by_condition, first_detections, roc_band
from irtrack.report.task_pictures import ManyTracks
from irtrack.report.task_sections import task_chapters

SCENE = """
seed: 3
frames: 24
severities:
  targets.b.path.angle_deg: [90, 20]
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, scr: 30}, path: {kind: straight, start: [20, 36], speed: 2, range_m: 3000}}
  - {id: b, shape: {kind: point, scr: 30}, path: {kind: crosses, target: a, at_frame: 12, speed: 2, angle_deg: 90}}
"""
FORGETS = """
import numpy as np


class Forgets:
    "Two straight tracks; where they begin near each other, they have other numbers from frame 10 on."

    def __init__(self):
        self.frame, self.tracks, self.near = 0, None, False

    def step(self, detections):
        found = np.array(sorted(detections.centers[np.argsort(-detections.scores)[:2]].tolist()))
        if self.tracks is None:
            self.tracks = [(place, np.zeros(2)) for place in found]
            self.near = np.hypot(*(found[0] - found[1])) < 20
        moved = []
        for place, velocity in self.tracks:
            expected = place + velocity
            apart = np.hypot(*(found - expected).T)
            if self.frame < 8 and apart.min() < 8:
                best = found[apart.argmin()]
                velocity = velocity + (best - expected) / (1 + self.frame / 2)
                expected = best
            moved.append((expected, velocity))
        self.tracks = moved
        self.frame += 1
        more = 10 * (self.frame > 10 and self.near)
        return [(more + k, (*place.tolist(), 3.0, 3.0), 1.0) for k, (place, _) in enumerate(self.tracks)]
"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a tracker that breaks at the second severity, and of two detectors."""
    folder = tmp_path_factory.mktemp("tasks")
    (folder / "sharp.yaml").write_text(SCENE)
    (folder / "forgets.py").write_text(FORGETS)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        import forgets  # type: ignore[import-not-found]  # written above

        source = irtrack.SourceEntry(folder / "sharp.yaml", severities="all")
        trackers = [irtrack.Entry("forgets", irtrack.make("forgets:Forgets", {"detector": "dog"}))]
        path = folder / "r.db"
        detectors = parse_detectors("tophat,dog")
        irtrack.run_bench([source], [*trackers, *detectors], results=path, seeds=2, input="counts").close()
        assert forgets.Forgets
    return path


def test_breaking_points_are_in_the_unit_of_the_scene(measured: Path) -> None:
    with irtrack.Results(measured) as results:
        found = {each.task: each for each in task_breaking(results.cells(), results.sources())}
    many = found["many"]
    assert (many.axis, many.x, many.severities) == ("angle, deg", (90.0, 20.0), (0, 1))
    assert many.points["forgets"].lost.tolist() == [0, 2]
    assert many.in_words("forgets") == "55 (> 90 to < 20)"
    assert found["detect"].points["dog"].lost.tolist() == [0, 0]
    json.dumps([each.as_dict() for each in found.values()], allow_nan=False)


def test_page_shows_the_worst_run(measured: Path, tmp_path: Path) -> None:
    page = irtrack.write_report(measured, tmp_path / "r.html").read_text()
    links = re.findall(r'<a href="#(switch-[0-9-]+)"', page)
    assert links
    assert set(links) <= set(re.findall(r'id="(switch-[0-9-]+)"', page))
    (replay,) = re.findall(r'class="replay many".*?<script type="application/json">(.*?)</script>', page, re.DOTALL)
    data = json.loads(replay)
    assert len(data["pictures"]) == len(data["tracks"]) == len(data["indices"]) == 24
    assert all(len(lane) == 24 for lane in data["lanes"])
    assert {identity["id"] for identity in data["identities"]} == {0, 1, 10, 11}
    assert data["switches"] == [10]
    for said in ("Breaking points.", "Time to first detection.", "Targets that are hard.", "bootstrap over runs"):
        assert said in page


def test_figures_as_data(measured: Path, tmp_path: Path) -> None:
    value = json.loads(irtrack.write_report(measured, tmp_path / "r.json").read_text())
    assert {row["task"] for row in value["tasks"]} == {"many", "detect"}
    assert {each["axis"] for each in value["task_breaking"]} == {"angle, deg"}
    assert value["sources"] == value["severities"] == []
    rows = list(csv.DictReader(io.StringIO(irtrack.write_report(measured, tmp_path / "r.csv").read_text())))
    assert {"many", "detect", "breaking_point"} == {row["part"] for row in rows}
    text = irtrack.write_report(measured, tmp_path / "r.md").read_text()
    assert "many, breaking points" in text
    assert "| forgets | 55 (" in text


def test_switches_and_styles_of_tracks() -> None:
    matches = np.array([[7, NOBODY], [7, 9], [8, 9], [NOBODY, 7], [8, 7]])
    empty = np.zeros(0)
    tracks = ManyTracks(np.arange(5), matches, matches >= 0, ("a", "b"), empty, empty, empty, empty, empty)
    assert tracks.switches() == [(2, 0, 7, 8), (3, 1, 9, 7)]
    assert list(tracks.styles()) == [7, 9, 8]
    assert len({style.color for style in tracks.styles().values()}) == 3


def test_bootstrap_covers_a_mean() -> None:
    """95 % interval of the mean of 30 runs, in 200 repetitions."""
    random = np.random.default_rng(1)
    values = random.binomial(1, 0.6, (30, 200)).astype(float)
    mean, low, high = bootstrap(values, np.ones_like(values))
    assert np.allclose(mean, values.mean(axis=0))
    assert 0.88 <= ((low <= 0.6) & (high >= 0.6)).mean() <= 0.99


def run_arrays() -> dict[str, np.ndarray]:
    """One run of two targets over 4 frames: the first is found in frames 1 and 3, the second never."""
    score = np.array([-np.inf, 5.0, 0.5, 4.0, -np.inf, -np.inf])
    condition = np.array(
        [[2, 1, 1, 9], [2, 20, 0.6, 9], [2, -20, 1, 1], [12, 5, 1, 9], [5, 5, 1, np.inf], [5, 5, 1, 9]]
    )
    return {
        "frames": np.arange(4),
        "target_score": score,
        "false_score": np.array([1.0, 2.0, 3.0, 2.0, 1.0]),
        "target_frame": np.array([0, 1, 2, 3, 0, 1]),
        "target_number": np.array([0, 0, 0, 0, 1, 1]),
        "target_condition": condition.astype(float),
    }


def test_figures_of_detectors_by_hand() -> None:
    rows = {row.condition: row for row in by_condition([run_arrays()])}
    # The threshold of 1 false alarm a frame is the least false score, 1: the score of 0.5 does not count.
    assert {name: (row.targets, row.pd) for name, row in rows.items()} == {
        "size < 3 px": (3, 1 / 3),
        "3 to 9 px": (2, 0.0),
        "≥ 9 px": (1, 1.0),
        "SCR < 3": (1, 0.0),
        "3 to 10": (3, 1 / 3),
        "≥ 10": (2, 0.5),
        "partly hidden": (1, 1.0),
        "clutter": (1, 0.0),
    }
    assert rows["clutter"].low is None
    held = first_detections([run_arrays()])
    assert held is not None
    assert (held.times.tolist(), held.held.tolist()) == ([1.0], [0.5])
    band = roc_band([run_arrays(), run_arrays()])
    assert band is not None
    assert band[0][-1] == pytest.approx(3 / 6)
    assert roc_band([]) is None
    assert first_detections([{"frames": np.arange(4)}]) is None


def test_chapters_of_older_results_have_no_conditions(measured: Path) -> None:
    """Results files written before a figure or an array was added still give a page."""
    with irtrack.Results(measured) as results:
        cells = [cell for cell in results.cells() if cell.key.task == "detect"]
        for cell in cells:
            cell.figures.pop("pd_1")
        chapters = task_chapters(results, cells, styles(sorted({cell.label for cell in cells})))
    assert [chapter.breaking for chapter in chapters] == [None, None]
