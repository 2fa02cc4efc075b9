"""Notebook cards of values: small, well formed, and no text becomes markup."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from html_page import Page

import irsim
import irtrack
from irsim.notebook import card, table
from irsim.types import Frame

HOSTILE = "<script>alert(1)</script>"
TEXT = """
frames: 12
about: A jet <before> sky
camera: {size: [96, 72]}
background: {kind: sky}
targets: [{id: jet, shape: {kind: fighter}, path: {kind: straight, start: [30, 36], speed: 1}}]
occluders: [{kind: bar, id: pole, center_px: [60, 36], size_px: [6, 60], range_m: 500}]
"""
LEAST_BYTES = 40_000
"""A card is to be smaller than this: a notebook may hold dozens."""


@pytest.fixture(scope="module")
def source() -> irsim.Rendering:
    return irsim.Rendering(irsim.loads(TEXT), HOSTILE)


def shown(value: object) -> str:
    """The HTML of a value, after checks that hold for each."""
    html = str(value._repr_html_())  # type: ignore[attr-defined]  # each of them has a card
    Page(html)  # well formed
    assert len(html) < LEAST_BYTES
    assert "<script" not in html
    return html


def test_a_scenario_shows_its_parts(source: irsim.Rendering) -> None:
    text = Page(shown(source.scenario)).text
    for word in ("A jet <before> sky", "12 at", "96 × 72 px", "jet (fighter, straight)", "pole", "sky"):
        assert word in text


def test_a_source_shows_its_middle_frame_with_the_true_box(source: irsim.Rendering, tmp_path: Path) -> None:
    recording = irsim.open_recording(irsim.record(source, tmp_path / "clip.mcap"))
    (target,) = next(iter(source.truths(6, 7))).targets
    for each in (source, recording):
        html = shown(each)
        assert f'<rect x="{target.box.left:.1f}" y="{target.box.top:.1f}"' in html
        assert "frame 6" in Page(html).text
        assert HOSTILE in Page(html).text or each.name == "clip"


def test_a_track_shows_its_way(source: irsim.Rendering) -> None:
    track = irtrack.run("template", source)
    html = shown(replace(track, tracker=HOSTILE))
    assert HOSTILE in Page(html).text
    assert html.count("<polyline") >= 1
    assert "tracking in " in Page(html).text
    alone = replace(track, indices=track.indices[:1], estimates=track.estimates[:1])
    assert "<circle" in shown(alone)


def test_results_show_the_ranked_table(source: irsim.Rendering, tmp_path: Path) -> None:
    with irtrack.run_bench([source], ["template", "kalman"], results=tmp_path / "r.db") as results:
        page = Page(shown(results))
        assert {row[1] for row in page.tables[0][1:]} == {"template", "kalman"}
        assert HOSTILE in page.text
    assert "r.db" in shown(results)  # closed: one line that says so


def test_a_value_prints_as_one_line_that_says_what_it_is(source: irsim.Rendering, tmp_path: Path) -> None:
    path = irsim.record(source, tmp_path / "clip.mcap")
    facts = "12 frames at 30 Hz, 96 x 72 px, 14 bits, truth of jet"
    frame, truth = source.frame(6), next(iter(source.truths(6, 7)))
    assert repr(irsim.open_recording(path)) == f"Recording({path}: {facts})"
    assert repr(source) == f"Rendering({HOSTILE}: {facts})"
    assert repr(source.scenario) == str(source.scenario)
    assert repr(source.scenario) == "Scenario(12 frames at 30 Hz, 96 x 72 px, background sky, targets jet, seed 0)"
    assert repr(frame) == "Frame(6 at 0.2 s: 96 x 72 px, 14 bits, uint16)"
    assert re.fullmatch(r"Truth\(6 at 0\.2 s: jet at \(3\d\.\d, 3\d\.\d\), [\d.]+ x [\d.]+ px\)", repr(truth))
    assert repr(replace(truth, targets=())) == "Truth(6 at 0.2 s: no target)"
    track = irtrack.run("grey_pf", source)
    assert repr(track) == f"Track(grey_pf on {HOSTILE}: jet, frames 0 to 11)"
    assert "\n" not in repr(track.estimates[-1])  # it holds a matrix and particles
    assert track.estimates[-1].particles is not None


def test_texts_of_cards_and_tables_are_escaped() -> None:
    assert HOSTILE not in card(HOSTILE, {HOSTILE: HOSTILE}) + table([HOSTILE], [[HOSTILE]])


def test_a_frame_shows_its_picture() -> None:
    html = Frame(np.arange(12, dtype=np.uint16).reshape(3, 4), 7, 0.5, 14)._repr_html_()
    assert "data:image/jpeg;base64," in html
    assert "Frame(7 at 0.5 s: 4 x 3 px, 14 bits, uint16): 0 black to 11 white" in html
