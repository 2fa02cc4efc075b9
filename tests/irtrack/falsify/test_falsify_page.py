"""What irtrack falsify leaves for people: what a rule asks beside what was reached, and the page in a real browser."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from browser import headless
from playwright.sync_api import Browser, expect
from report_fakes import Still
from test_falsify_parts import trace
from test_report_browser import contrast

import irsim
from irsim.scenario.expectation import Expectation
from irtrack.falsify import Failure, Luck
from irtrack.falsify.counterexample import Case
from irtrack.falsify.falsification import Hunt
from irtrack.falsify.outputs import FOUND, JOURNAL, write_failure
from irtrack.falsify.rules import ASKED, MARGINS, RAISES, REACHED, asked, reached, rules_of
from irtrack.falsify.trial import Subject, Trials
from irtrack.metrics import Trace
from irtrack.types import Tracker

# -- a rule in words, and what was reached of it, by hand; the target is 5 px across, off begins above 5 px

HIDDEN = [1, 1, *[0] * 8, 1, 1, 1]


@pytest.mark.parametrize(
    ("rule", "found", "asks", "got"),
    [
        (
            irsim.NeverLost(),
            trace([0, 9, 9, 1, *[9] * 4, *[9] * 2, 1], [1] * 6 + [0] * 2 + [1] * 3),
            "never 10 frames in a row off the target while it can be seen",
            "4 frames in a row off it, from frame 4 on",  # 4, 5, 8, 9: hidden ones do not count
        ),
        (irsim.NeverLost(), trace([0, 1]), "never 10 frames", "never off the target"),
        (
            irsim.ErrorBelow(px=3),
            trace([0, 1, 7.25, 2]),
            "a centre error of at most 3 px in every frame",
            "7.25 px, at frame 2",
        ),
        (
            irsim.ErrorBelow(px=3, share=0.95),
            trace([0, *[2.0] * 17, 4.0, 5.0, 6.0]),
            "at most 3 px in 95 % of the frames",
            "5 px, at frame 19",  # of 20 frames one may be worse
        ),
        (irsim.ErrorBelow(px=3), trace([0, 0], [1, 0]), "at most 3 px", "no frame that counts"),
        (
            irsim.ReacquiredWithin(frames=1),
            trace([0.0] * 10 + [9, 8, 7], HIDDEN),
            "on the target again within 1 frame of its coming back",
            "still not at frame 12, 2 frames after it came back at frame 10",
        ),
        (irsim.ReacquiredWithin(frames=1), trace([0.0] * 10 + [9, 8, 2], HIDDEN), "", "2 frames after it came back at"),
        (irsim.ReacquiredWithin(frames=1), trace([0.0] * 3), "", "no return that tells"),
        (
            irsim.HonestWhileHidden(within=5),
            trace([0.0] * 13, HIDDEN, ["tracking"] * 9 + ["lost"] * 4),
            '"tracking" said no longer than 5 frames after the target went',
            "7 frames after it went, at frame 2",
        ),
        (irsim.HonestWhileHidden(), trace([0.0] * 3), "", "no frame without the target"),
    ],
)
def test_what_is_asked_stands_beside_what_is_reached(rule: Expectation, found: Trace, asks: str, got: str) -> None:
    assert asks in asked(rule)
    assert reached(rule, found).startswith(got)


def test_every_kind_of_rule_has_words_and_ones_own_its_margin() -> None:
    class Own(Expectation):
        def margin(self, found: Trace) -> float:
            return -0.125

    assert set(MARGINS) == set(ASKED) == set(REACHED)
    assert (asked(Own()), reached(Own(), trace([0, 0]))) == ("a margin of 0 or more", "a margin of -0.125")


# -- the page

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
    """The folder of a failure and its page's text."""

    folder: Path
    page: str


def left(folder: Path, tracker: Tracker, rule: int | str, least_luck: Luck | None) -> Left:
    """What is written of a failure that was found at speed 1.5 and shrunk to speed 1 and nine frames."""
    scene = irsim.loads(SCENE)
    folder.mkdir()
    (folder / JOURNAL).touch()
    subject = Subject("still", tracker, "display", rules_of(scene))
    hunt = Hunt(scene, subject, Trials(subject, folder / JOURNAL), print)
    speed = "targets.jet.path.speed"
    least = Case({speed: 1.0}, ("white",), 9)
    failure = Failure(rule, 7, Case({speed: 1.5}), Luck(12, 20), True, least, least_luck)
    write_failure(folder, hunt, failure, "jets", "irtrack falsify jets.yaml --tracker still")
    return Left(folder, (folder / "replay.html").read_text())


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """A tracker that stands still: at speed 1 its error at frame k is k px."""
    return left(tmp_path_factory.mktemp("falsify") / "out", Still(), 0, Luck(20, 20))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with headless() as found:
        yield found


def test_the_page_says_what_was_found_and_how(browser: Browser, moved: Left) -> None:
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


def test_it_names_no_file_that_is_not_there(moved: Left) -> None:
    links = re.findall(r'href="([^"#:]+)"', moved.page)
    assert sorted(links) == sorted({*FOUND, JOURNAL} - {"replay.html"})
    report = (moved.folder / "report.md").read_text()
    told = re.sub(r"<script.*?</script>", "", moved.page, flags=re.S)
    named = set(re.findall(r"[\w./-]+\.(?:yaml|mcap|db|html|md|jsonl)\b", told))
    named |= set(re.findall(r"^- `(.*?)`", report, re.M))
    named -= {"jets.yaml"}  # of the command that was given
    assert "minimal.yaml" in named
    assert not [name for name in named if not (moved.folder / name).exists()]
    run = next(line for line in report.splitlines() if line.startswith("irtrack run"))
    assert moved.folder / "minimal.yaml" in map(Path, shlex.split(run))
    assert "report.md" not in (moved.folder / "minimal.yaml").read_text()  # it is kept without it


def test_what_was_raised_is_told_whole(tmp_path: Path) -> None:
    found = left(tmp_path / "out", Still(raise_at=4, text="<b>planted</b>"), RAISES, None)
    assert "<h1>still on jets: it raises</h1>" in found.page
    assert "&lt;b&gt;planted&lt;/b&gt;" in found.page
    assert "<b>planted" not in found.page
    assert "not told, for the hunt was stopped" in found.page
    assert "Traceback" in found.page
    assert '<div class="replay"' not in found.page


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_the_page_fits_its_window_and_can_be_read(browser: Browser, moved: Left, width: int, scheme: Any) -> None:
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    page.goto((moved.folder / "replay.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    shown = "getComputedStyle(document.querySelector('.verdict')).backgroundColor"
    assert contrast(*page.evaluate(f"[getComputedStyle(document.body).color, {shown}]")) >= 4.5
    page.close()
