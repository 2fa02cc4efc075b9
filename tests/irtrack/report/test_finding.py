"""Report of a failure: the page in a browser, and the files that it names."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from browser import headless
from playwright.sync_api import Browser, expect
from report_fakes import Still

import irsim
from irtrack.falsify import Failure, SeedSensitivity
from irtrack.falsify.counterexample import Candidate
from irtrack.falsify.falsification import Falsification
from irtrack.falsify.find import write_failure
from irtrack.falsify.outputs import FOUND, JOURNAL
from irtrack.falsify.rules import RAISES, rules_of
from irtrack.falsify.trial import Subject, Trials
from irtrack.report.finding import write_failure_report
from irtrack.types import Tracker

SCENE = """
seed: 3
frames: 30
camera: {size: [64, 48], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - id: jet
    shape: {kind: point, temperature_k: 330}
    path: {kind: straight, start: [12, 24], speed: 0.5, range_m: 1500}
vary:
  targets.jet.path.speed: {kind: uniform, low: 0, high: 2}
expect: [{kind: error_below, px: 4}]
"""


@dataclass
class Left:
    """Folder of a failure, and the text of its page."""

    folder: Path
    page: str


def left(folder: Path, tracker: Tracker, rule: int | str, least: SeedSensitivity | None) -> Left:
    """Write the report of a failure found at speed 1.5 and shrunk to speed 1 and nine frames."""
    scene = irsim.loads(SCENE)
    folder.mkdir()
    (folder / JOURNAL).touch()
    subject = Subject("still", tracker, "display", rules_of(scene))
    trials, command = Trials(subject, folder / JOURNAL), "irtrack falsify jets.yaml --tracker still"
    falsification = Falsification(scene, subject, trials, name="jets", command=command)
    speed = "targets.jet.path.speed"
    smallest = Candidate({speed: 1.0}, ("white",), 9)
    failure = Failure(rule, 7, Candidate({speed: 1.5}), SeedSensitivity(12, 20), True, smallest, least)
    write_failure(falsification, failure, folder, write_failure_report)
    return Left(folder, (folder / "replay.html").read_text())


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """A stationary estimate: at speed 1 its error at frame k is k px."""
    return left(tmp_path_factory.mktemp("falsify") / "out", Still(), 0, SeedSensitivity(20, 20))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with headless() as found:
        yield found


def test_page_has_verdict_search_and_replay(browser: Browser, moved: Left) -> None:
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text))
    page.goto((moved.folder / "replay.html").as_uri())
    assert page.inner_text("h1") == "still on jets: error_below (px 4.0, share 1.0) is broken"
    verdict = page.inner_text(".verdict")
    assert "a centre error of at most 4 px in every frame" in verdict
    assert "8 px, at frame 8" in verdict
    assert "-1, broken below 0" in verdict
    assert "structural: 20 of 20 fresh seeds break it too" in verdict
    way = page.inner_text("#found")
    assert "at run 7 of the search, with scene seed 3" in way
    assert "seed-dependent: 12 of 20 fresh seeds break it too" in way
    assert "9 of 30" in way
    assert re.search(r"targets\.jet\.path\.speed\s+0\.5\s+1\.5\s+1\b", way)
    assert "white" in way
    expect(page.locator("output")).to_contain_text("frame 0")
    page.press(".replay", "End")
    assert page.inner_text("output").startswith("frame 8")
    assert "8.0" in page.inner_text(".now tbody")
    assert errors == []
    page.close()


def test_page_names_only_existing_files(moved: Left) -> None:
    links = re.findall(r'href="([^"#:]+)"', moved.page)
    assert sorted(links) == sorted({*FOUND, JOURNAL} - {"replay.html"})
    report = (moved.folder / "report.md").read_text()
    text = re.sub(r"<script.*?</script>", "", moved.page, flags=re.S)
    named = set(re.findall(r"[\w./-]+\.(?:yaml|mcap|db|html|md|jsonl)\b", text))
    named |= set(re.findall(r"^- `(.*?)`", report, re.M))
    named -= {"jets.yaml"}  # in the command
    assert "minimal.yaml" in named
    assert not [name for name in named if not (moved.folder / name).exists()]
    run = next(line for line in report.splitlines() if line.startswith("irtrack run"))
    assert moved.folder / "minimal.yaml" in map(Path, shlex.split(run))
    assert "report.md" not in (moved.folder / "minimal.yaml").read_text()  # the kept copy has no report


def test_page_shows_the_whole_exception(tmp_path: Path) -> None:
    found = left(tmp_path / "out", Still(raise_at=4, text="<b>planted</b>"), RAISES, None)
    assert "<h1>still on jets: the tracker raises an exception</h1>" in found.page
    assert "&lt;b&gt;planted&lt;/b&gt;" in found.page
    assert "<b>planted" not in found.page
    assert "unknown: the search was interrupted" in found.page
    assert "Traceback" in found.page
    assert '<div class="replay"' not in found.page
