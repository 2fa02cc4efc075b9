"""The ranked table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from irtrack.bench import ALL_SOURCES, Key, RunRecord, summary
from irtrack.cli.output import print_summary
from irtrack.metrics import FIGURES, Score, wilson


def cell(label: str, source: str = "s", seed: int = 0, **figures: Any) -> RunRecord:
    key = Key(f"{source}{seed}", "a", "visible", "display", seed, seed, "{}", "c")
    if not figures:
        return RunRecord(key, label, source, source, "failed", "broke")
    unsaid = dict.fromkeys(FIGURES) | {"frames": 10, "held_frames": 10, "lost": False}
    return RunRecord(key, label, source, source, "ok", score=Score.from_dict(unsaid | figures))


def test_pooled_figures_by_hand() -> None:
    long = cell("t", held_frames=30, error_held=2.0, abs_x_held=1.0, sd_x_held=0.0, rmse_held=2.0, success_auc=0.6)
    held: dict[str, Any] = {"held_frames": 10, "error_held": 6.0, "abs_x_held": 5.0, "sd_x_held": 2.0, "rmse_held": 6.0}
    short = cell("t", seed=1, lost=True, success_auc=0.2, **held)
    gone = cell("t", seed=2, held_frames=0, lost=True)
    (row,) = summary([long, short, gone, cell("t", seed=3)])
    assert (row.runs, row.repeats, row.failed, row.scored, row.lost) == (4, 0, 1, 3, 2)
    assert row.lost_share == pytest.approx(2 / 3)
    assert (row.lost_low, row.lost_high) == wilson(2, 3)
    assert row.held.error == pytest.approx((30 * 2 + 10 * 6) / 40)
    assert row.held.abs_x == pytest.approx((30 * 1 + 10 * 5) / 40)
    # thirty values 1 and ten of mean 5, sd 2: say five 3s and five 7s
    assert row.held.sd_x == pytest.approx(np.std([1.0] * 30 + [3.0] * 5 + [7.0] * 5))
    assert row.held.rmse == pytest.approx(math.sqrt((30 * 4 + 10 * 36) / 40))
    assert row.success_auc == pytest.approx(0.4)
    assert row.held.abs_y is None


def test_order_of_ranks() -> None:
    told: dict[str, Any] = {"off_share": 0.0, "error_held": 1.0, "ms_median": 1.0}
    cells = [
        cell("failed"),
        cell("lost", lost=True, **told),
        cell("off", **told | {"off_share": 0.1}),
        cell("far", **told | {"error_held": 2.0}),
        cell("slow", **told | {"ms_median": 2.0}),
        cell("best", **told),
    ]
    assert [(row.label, row.rank) for row in summary(cells)] == [
        ("best", 1), ("slow", 2), ("far", 3), ("off", 4), ("lost", 5), ("failed", 6),
    ]  # fmt: skip


def test_the_table_by_source_and_over_all() -> None:
    cells = [cell("a", "one", error_held=1.0), cell("a", "two", error_held=3.0), cell("b", "two", error_held=2.0)]
    assert [(row.source, row.label, row.rank) for row in summary(cells)] == [
        ("one", "a", 1), ("two", "b", 1), ("two", "a", 2),
    ]  # fmt: skip
    overall = summary(cells, overall=True)
    assert {(row.source, row.label): row.held.error for row in overall} == {
        (ALL_SOURCES, "a"): 2.0, (ALL_SOURCES, "b"): 2.0,
    }  # fmt: skip
    # b is first, for on the scene that both have, a is worse
    assert [(row.label, row.runs, row.compared) for row in overall] == [("b", 1, 1), ("a", 2, 1)]
    assert overall[1].as_dict()["runs"] == 2


def test_trackers_are_ranked_by_the_seeds_that_all_have() -> None:
    hard = [cell("many", seed=seed, lost=seed > 0, error_held=1.0) for seed in range(4)]
    easy = [cell("few", seed=0, lost=False, error_held=2.0)]
    rows = summary([*hard, *easy])  # few has only the easy scene: that it lost none there is no merit
    assert [(row.label, row.runs, row.compared, row.lost) for row in rows] == [("many", 4, 1, 3), ("few", 1, 1, 0)]
    apart = summary([*hard[1:], *easy])
    assert [(row.label, row.compared) for row in apart] == [("few", 1), ("many", 3)]


@pytest.mark.parametrize(("seeds", "standing"), [(6, "told"), (5, "too few")])
def test_standing_of_a_failing_tracker(seeds: int, standing: str) -> None:
    """A failed run counts as lost: six differences of one sign in six are told, sign test 2/2^6 = 3 %, five are not."""
    held = [cell("held", seed=seed, lost=False, off_share=0.0, error_held=1.0) for seed in range(seeds)]
    rows = summary([*held, *(cell("failed", seed=seed) for seed in range(seeds))])
    assert [(row.label, row.standing) for row in rows] == [("held", "told"), ("failed", standing)]


def test_printed_errors_before_the_loss_are_named_so(capsys: pytest.CaptureFixture[str]) -> None:
    print_summary(summary([cell("gone", lost=True, abs_x_held=0.1), cell("kept", abs_x_held=2.0)]))
    out = capsys.readouterr().out
    assert "|x| held" in out
    assert "|x| px" not in out
    assert "held: mean |error|, px, before the loss" in out
