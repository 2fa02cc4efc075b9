"""The report in a browser: replay, layout, and no request from the page."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import contrast, headless
from playwright.sync_api import Browser, Page, expect
from report_fakes import Still

import irsim
from irsim.types import Source
from irtrack import run_bench, write_report
from irtrack.bench import Entry, parse_tracker_spec

SCENE = """
frames: 40
camera: {size: [96, 72], netd_mk: 40, noise: [{kind: white}]}
background: {kind: sky}
targets:
  - id: jet
    shape: {kind: fighter}
    path: {kind: straight, start: [20, 36], speed: 1.6, range_m: 3000}
"""
HOSTILE = """</script><img src=x onerror="window.hacked=1"><script>window.hacked=2</script>"""


@dataclass
class Report:
    """Page of a small bench, its scene, and the frame of the loss of `still`."""

    path: Path
    source: Source
    lost_at: int


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    folder = tmp_path_factory.mktemp("browser")
    source = irsim.Rendering(irsim.loads(SCENE), HOSTILE)
    entries = [
        parse_tracker_spec("cloud=grey_pf:particles=40"),
        Entry("still", Still()),
        Entry(HOSTILE, Still(raise_at=3, text=HOSTILE)),
    ]
    with run_bench([source], entries, results=folder / "r.db", command=HOSTILE) as results:
        lost = [cell.score.lost_at for cell in results.cells() if cell.label == "still" and cell.score]
        assert lost[0] is not None
        return Report(write_report(results), source.with_seed(0), lost[0])


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with headless() as found:
        yield found


@dataclass
class Opened:
    """Opened page with its requests and errors."""

    page: Page
    requests: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    @property
    def frame(self) -> int:
        """Frame of the replay."""
        found = re.match(r"frame (\d+)", self.page.inner_text("output"))
        assert found
        return int(found[1])

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.press(".replay", key)

    def picture(self) -> Any:
        """Return the grey picture of the canvas at the size of the frame."""
        self.page.wait_for_timeout(100)
        uri = self.page.evaluate("document.querySelector('.stage').toDataURL('image/png')")
        image = cv2.imdecode(np.frombuffer(base64.b64decode(uri.partition(",")[2]), np.uint8), cv2.IMREAD_GRAYSCALE)
        return cv2.resize(np.asarray(image), (96, 72), interpolation=cv2.INTER_AREA).astype(float)


@pytest.fixture
def opened(browser: Browser, report: Report) -> Iterator[Opened]:
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    found = Opened(page)
    page.on("request", lambda request: found.requests.append(request.url))
    page.on("pageerror", lambda error: found.errors.append(str(error)))
    page.on("console", lambda message: found.errors.append(message.text))
    page.goto(report.path.as_uri())
    page.locator(".replay").scroll_into_view_if_needed()
    expect(page.locator("output")).not_to_be_empty()
    yield found
    page.close()
    assert found.errors == []


def test_keys_move_through_the_frames(opened: Opened) -> None:
    start = opened.frame
    opened.press("ArrowRight", "ArrowRight", "ArrowLeft")
    assert opened.frame == start + 1
    opened.press("Shift+ArrowRight")
    assert opened.frame == start + 11
    opened.press("End")
    assert opened.frame == 39
    opened.press("ArrowRight")
    assert opened.frame == 39
    opened.press("Home")
    assert opened.frame == start


def test_next_loss_button(opened: Opened, report: Report) -> None:
    opened.page.click(".loss")
    assert opened.frame == report.lost_at
    row = opened.page.locator(".now tbody tr", has_text="still")
    assert "lost" in row.inner_text()
    assert "occluded" in row.inner_text()  # its status


def test_picture_is_the_frame(opened: Opened, report: Report) -> None:
    """Against the frames of the source: JPEG changes pixels less than the next frame does."""
    for box in opened.page.locator(".show-truth, .show-particles, .show-tracker").all():
        box.uncheck()
    opened.press("Home", *["ArrowRight"] * 7)
    shown = opened.picture()
    truth = report.source.frame(7, "display").image.astype(float)
    other = report.source.frame(8, "display").image.astype(float)
    assert np.abs(shown - truth).mean() < 5
    assert np.abs(shown - other).mean() > 2 * np.abs(shown - truth).mean()


@pytest.mark.parametrize("switch", [".show-truth", ".show-particles"])
def test_switch_hides_its_marks(opened: Opened, switch: str) -> None:
    opened.press("ArrowRight")
    before = opened.picture()
    opened.page.locator(switch).uncheck()
    assert np.abs(opened.picture() - before).max() > 10
    opened.page.locator(switch).check()
    assert np.array_equal(opened.picture(), before)


def test_no_request_and_no_injected_code(opened: Opened) -> None:
    assert [url for url in opened.requests if not url.startswith("data:")] == [opened.requests[0]]
    assert opened.page.evaluate("window.hacked") is None
    assert HOSTILE in opened.page.inner_text("h2 >> nth=0")
    assert HOSTILE in opened.page.locator("#failures").inner_text()


@pytest.mark.parametrize(("width", "scheme"), [(360, "dark"), (1280, "light")])
def test_page_fits_the_window_with_contrast(browser: Browser, report: Report, width: int, scheme: Any) -> None:
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    page.goto(report.path.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    ink, paper = page.evaluate(
        "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    )
    assert contrast(ink, paper) >= 4.5
    page.close()


def test_replay_has_the_times_of_its_frames(opened: Opened) -> None:
    """Defect 6: "frame 27, 0.00 s" where frame 27 is .90 s."""
    for index in (0, 27, 39):
        opened.press("Home", *["Shift+ArrowRight"] * (index // 10), *["ArrowRight"] * (index % 10))
        assert opened.page.inner_text("output").startswith(f"frame {index}, {index / 30:.2f} s")


def test_names_are_whole_and_the_page_is_still_at_400_px(browser: Browser, report: Report) -> None:
    """Defect 10: names of trackers broke within a word, and a longer frame label moved the page."""
    page = browser.new_page(viewport={"width": 400, "height": 800})
    page.goto(report.path.as_uri())
    page.locator(".replay").scroll_into_view_if_needed()
    lines = page.evaluate(
        """[...document.querySelectorAll('.scores .name')].filter(name => /^(cloud|still)$/.test(name.innerText.trim()))
        .map(name => { const range = document.createRange(); range.selectNodeContents(name.lastChild);
                       return range.getClientRects().length })"""
    )
    assert lines
    assert set(lines) == {1}
    heights = set()
    for key in ("Home", "ArrowRight", "End"):
        page.press(".replay", key)
        heights.add(page.evaluate("document.documentElement.scrollHeight"))
    assert len(heights) == 1
    page.close()


def test_printed_tables_are_whole_and_replays_are_left_out(browser: Browser, report: Report) -> None:
    """Defect 5: on paper, tables were cut and replays were black boxes."""
    page = browser.new_page(viewport={"width": 700, "height": 990})  # A4 with margins, at 96 px an inch
    page.goto(report.path.as_uri())
    page.emulate_media(media="print")
    cut = page.evaluate(
        """[...document.querySelectorAll('table')].filter(table => table.offsetWidth > 0)
        .filter(table => table.getBoundingClientRect().right > document.documentElement.clientWidth + 1).length"""
    )
    assert cut == 0
    assert not page.locator(".replay").first.is_visible()
    assert page.locator(".still").first.is_visible()
    page.close()
