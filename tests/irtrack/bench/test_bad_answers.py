"""Wrong answers of detectors and of trackers of many in a bench: one line each, and the others are measured."""

from __future__ import annotations

from pathlib import Path

import pytest

import irsim
import irtrack
from irtrack.bench.spec import parse_detectors, parse_trackers
from irtrack.metrics.ceiling import CEILING

SCENE = """
seed: 3
frames: 24
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - {id: a, shape: {kind: point, scr: 30}, path: {kind: straight, start: [20, 30], speed: 1, range_m: 3000}}
  - {id: b, shape: {kind: point, scr: 30}, path: {kind: straight, start: [20, 50], speed: 1.2, range_m: 3000}}
"""

MODULE = """
import numpy as np
from irtrack.types import Detections
from irtrack.tracks import TrackFrame
from irsim import Box

def images(image):
    return image

class Nan:
    task = "detect"
    def step(self, state, frame):
        places = np.array([[5.0, 5.0], [9.0, np.nan if frame.index == 4 else 9.0]])
        return None, Detections(places, np.full((2, 2), 5.0), np.ones(2))

class Twice:
    def step(self, detections):
        return [(7, Box(5, 5, 5, 5), 1.0), (7, Box(50, 50, 5, 5), 1.0)]

class Words:
    steps = 0
    def step(self, detections):
        self.steps += 1
        return [(7 if self.steps < 5 else "7", (5, 5, 5, 5), 1.0)]

class Reals:
    def start(self, image):
        self.steps = 0
    def step(self, image):
        self.steps += 1
        frame = TrackFrame.of([(7, Box(5, 5, 5, 5), 1.0)])
        return TrackFrame(frame.ids.astype(float if self.steps > 2 else int), *list(
            getattr(frame, name) for name in ("centers", "sizes", "scores", "statuses", "confirmed")))

class Boxes:
    def step(self, detections):
        return [(7, (5, 5, float("nan"), 5), 1.0)]

class Sure:
    def step(self, detections):
        return [(7, (5, 5, 5, 5), float("inf"))]

class Huge:
    def step(self, detections):
        return [(2**70, (5, 5, 5, 5), 1.0)]
"""
SAID = {
    "badly:images": "badly:images: frame 0: detect gave an image, uint16 of shape (72, 96); allowed: ",
    "badly:Nan": "badly:Nan: frame 4: the centers of detection 1 are not finite",
    'gnn:detector="badly:Nan"': "badly:Nan: frame 4: the centers of detection 1 are not finite",
    'gnn:detector="badly:images"': "badly:images: frame 0: detect gave an image, ",
    "badly:Twice": "badly:Twice: frame 1: two tracks have the id 7; allowed: each id once a frame",
    "badly:Words": "badly:Words: frame 4: step gave [('7', (5, 5, 5, 5), 1.0)]; allowed: a list of (id, box, score)",
    "badly:Reals": "badly:Reals: frame 3: the ids are float64 of shape (1,); allowed: whole numbers (n,)",
    "badly:Boxes": "badly:Boxes: frame 1: the sizes of track 7 are not finite",
    "badly:Sure": "badly:Sure: frame 1: the score of track 7 is infinite; allowed: a number, or nan",
    "badly:Huge": "allowed: a list of (id, box, score), id an int64, ",
}


def test_wrong_answers_are_one_line_and_others_are_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "badly.py").write_text(MODULE)
    detectors = ",".join(["dog", *list(SAID)[:2]])
    compared = [*parse_detectors(detectors), *parse_trackers(",".join(["gnn:detector=dog", *list(SAID)[2:]]))]
    source = irsim.Rendering(irsim.loads(SCENE), "two")
    with irtrack.run_bench([source], compared, results=tmp_path / "r.db", input="counts") as results:
        cells = {cell.label: cell for cell in results.cells()}
        page = irtrack.write_report(results, tmp_path / "r.html").read_text()
    assert {label for label, cell in cells.items() if cell.status == "ok"} == {"dog", "gnn:detector=dog", CEILING}
    assert cells["dog"].figures["pd"] > 0.9
    assert cells["gnn:detector=dog"].figures["found"] == 1
    for label, said in SAID.items():
        failure = cells[label].failure
        assert failure is not None
        assert failure.count("\n") == 0, failure
        assert said in failure
    assert "the sizes of track 7 are not finite" in page
