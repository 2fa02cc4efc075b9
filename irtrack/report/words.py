"""Figures in words, as the page and the Markdown say them."""

from __future__ import annotations

from collections.abc import Sequence

from irsim.errors import counted
from irtrack.bench import SummaryRow

NOTHING = "–"


def px(value: float | None) -> str:
    """A length in px, two decimals."""
    return NOTHING if value is None else f"{value:.2f}"


def share(value: float | None) -> str:
    """A share or an area 0..1, three decimals."""
    return NOTHING if value is None else f"{value:.3f}"


def percent(value: float | None) -> str:
    """A share in whole percent."""
    return NOTHING if value is None else f"{100 * value:.0f} %"


def ms(value: float | None) -> str:
    """A time in ms, three significant digits."""
    return NOTHING if value is None else f"{value:.3g}"


def lead(rows: Sequence[SummaryRow]) -> str:
    """The outcome in a sentence or two; rows in the order of their rank."""
    sentences = []
    scored = [row for row in rows if row.scored]
    if scored:
        best, worst = scored[0], scored[-1]
        sentence = f"{best.label} lost the target in {best.lost} of {counted(best.scored, 'run')}"
        sentences.append(sentence if worst is best else f"{sentence}, {worst.label} in {worst.lost} of {worst.scored}")
    else:
        sentences.append("No run could be scored: there is no truth to compare with, or every run failed")
    failed = sum(row.failed for row in rows)
    if failed:
        sentences.append(f"{counted(failed, 'run')} failed")
    return ". ".join(sentences) + "."
