"""Parts of the report: filmstrips, charts, texts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from traces import trace_at

from irtrack.bench import SummaryRow
from irtrack.metrics import Trace
from irtrack.report.formats import lead
from irtrack.report.frames import CROP_LEAST, Follower, moments, still
from irtrack.report.line_styles import styles
from irtrack.report.plots import Axis, Line, hidden_spans, line_chart


def trace(visible: list[float], distance: float = 0.0) -> Trace:
    """Return a track at a constant distance from a target that moves 1 px a frame to the right."""
    count = len(visible)
    truth = np.column_stack([np.arange(count) + 10.0, np.full(count, 10.0)])
    return trace_at(np.tile([distance, 0.0], (count, 1)), (6.0, 6.0), truth_centers=truth, visible=np.array(visible))


def follower(label: str, lost_at: int | None, visible: list[float], distance: float = 0.0) -> Follower:
    return Follower(label, styles([label])[label], trace(visible, distance), lost_at)


def test_filmstrip_shows_start_occlusion_loss_end() -> None:
    visible = [1.0] * 10 + [0.0] * 5 + [1.0] * 15
    shown = moments([follower("a", None, visible), follower("b", 20, visible), follower("c", 25, visible)])
    assert shown == {0: "start", 9: "before it hides", 12: "hidden", 15: "seen again", 20: "b is lost", 29: "end"}


def test_filmstrip_is_filled_evenly() -> None:
    assert list(moments([follower("a", None, [1.0] * 101)], 3)) == [0, 50, 100]
    assert list(moments([follower("a", None, [1.0] * 3)], 6)) == [0, 1, 2]
    assert moments([follower("a", None, [1.0])]) == {0: "end"}
    assert list(moments([follower("a", None, [1.0, 1.0, 0.0, 0.0])], 3)) == [0, 1, 2, 3]


def test_still_is_cropped_around_the_target() -> None:
    image = np.zeros((60, 80), np.uint8)
    shown = still(image, 3, "start", [follower("a", None, [1.0] * 5, distance=3.0)])
    # The true centre is (13, 10), its size 6: a square of 40 px, moved to lie inside the frame.
    assert f'viewBox="-0.5 -0.5 {CROP_LEAST} {CROP_LEAST}"' in shown.crop
    assert 'viewBox="-0.5 -0.5 80 60"' in shown.whole
    assert 'x="13.00" y="7.00" width="6.00" height="6.00" stroke=' in shown.crop  # the tracker: 16 - 3
    assert 'x="10.00" y="7.00" width="6.00" height="6.00" class="truth"' in shown.crop
    assert shown.notes[0].distance == pytest.approx(3.0)


def test_hidden_spans_by_majority_of_seeds() -> None:
    one, two, three = ([1, 0, 0, 1, 0], [1, 0, 1, 1, 0], [1, 1, 0, 1, 0])
    traces = [trace([float(v) for v in visible]) for visible in (one, two, three)]
    assert hidden_spans(np.arange(5), traces) == [(0.5, 2.5), (3.5, 4.5)]


def test_chart_is_reproducible_and_uses_page_colours() -> None:
    style = styles(["a"])["a"]
    line = Line(style, np.arange(5.0), np.array([1.0, 10.0, np.nan, 0.5, 2.0]))

    def draw() -> str:
        return line_chart([line], Axis("frame"), Axis("error", log=True), size=(300, 200), name="<one>")

    chart = draw()
    assert chart == draw()
    assert chart.startswith("<svg ")
    assert "<one>" not in chart
    assert "#000000" not in chart
    assert style.color in chart
    assert "currentColor" in chart
    assert ">frame</text>" in chart


def test_lead_sentence() -> None:
    def row(label: str, lost: int, scored: int, failed: int = 0) -> SummaryRow:
        named: dict[str, Any] = dict.fromkeys(SummaryRow.__dataclass_fields__)
        counts = {"lost": lost, "scored": scored, "failed": failed, "runs": scored + failed}
        return SummaryRow(**{**named, "source": "s", "label": label, "rank": 1, **counts})

    assert lead([row("a", 1, 4), row("b", 4, 4)]) == "a lost the target in 1 of 4 runs, b in 4 of 4."
    assert lead([row("a", 0, 2, failed=1)]) == "a lost the target in 0 of 2 runs. 1 run failed."
    assert lead([row("a", 0, 0, failed=2)]).startswith("No run could be scored")
