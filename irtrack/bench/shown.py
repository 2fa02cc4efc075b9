"""How a results file shows itself in a notebook: the ranked table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from irsim.notebook import table
from irtrack.bench.cell import Cell
from irtrack.bench.table import MARKS, SummaryRow, summary

MOST_ROWS = 40
"""A longer table is cut: the report has it all."""

HEAD = ("", "tracker", "source", "runs", "lost", "95 %", "rmse before loss, px", "≤ 20 px", "AUC", "ms")


def results_card(name: str, cells: Iterable[Cell]) -> str:
    """The ranked table of each source, under the file's name."""
    rows = summary(cells)
    more = f"<p>… {len(rows) - MOST_ROWS} more rows</p>" if len(rows) > MOST_ROWS else ""
    return f"<p><b>{escape(name)}</b></p>{table(HEAD, [_told(row) for row in rows[:MOST_ROWS]])}{more}"


def _told(row: SummaryRow) -> Sequence[object]:
    return (
        f"{row.rank}{MARKS[row.standing]}",
        row.label,
        row.source,
        row.runs,
        _number(row.lost_share, ".0%"),
        "–" if row.lost_low is None else f"{row.lost_low:.0%} to {row.lost_high:.0%}",
        _number(row.held.rmse, ".2f"),
        _number(row.precision_20, ".3f"),
        _number(row.success_auc, ".3f"),
        _number(row.ms_median, ".3g"),
    )


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)
