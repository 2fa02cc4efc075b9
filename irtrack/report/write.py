"""Figures in words, as the page and the Markdown say them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from irsim import Rendering, loads, open_recording
from irsim.config.base import suggestion
from irsim.config.paths import path_of
from irsim.errors import counted
from irsim.recording.output import atomic_text, check_output
from irsim.types import Source
from irtrack.bench import Results, RunRecord, SourceRow, SummaryRow, summary
from irtrack.errors import InputError
from irtrack.report.figure_data import Figures, failures, measured, severity_figures, source_figures
from irtrack.report.formats import as_csv, as_json, as_markdown

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


def opened(row: SourceRow) -> Source:
    """The source as it is now, whose hash may be another one; irsim's errors where it is gone.

    A scenario runs no code that it names: a results file may come from anywhere.
    """
    source: Source
    if row.kind == "recording":
        source = open_recording(row.text)
    else:
        source = Rendering(loads(row.text, row.name, trusted=False), row.name)
    return source


def write_report(
    results: Results | str | Path,
    out: str | Path | None = None,
    format: str | None = None,
) -> Path:
    """Write the report of a results file and return its path.

    results  an open results file or its path
    out      report.html (.json, .csv, .md) beside it where not given
    format   one of `FORMATS`, and the ending of `out`; by that ending, or html, where not given

    InputError where there is no such results file, nothing in it, no such format, or no folder to write to.
    """
    if not isinstance(results, Results):
        with Results(results) as opened:
            return write_report(opened, out, format)
    if format is not None and format not in FORMATS:
        raise InputError(f"format '{format}': allowed: {', '.join(FORMATS)}{suggestion(format, FORMATS)}")
    path = results.path.with_name(f"report.{format or 'html'}") if out is None else path_of(out)
    check_output(path, results.path, endings=[f".{each}" for each in (FORMATS if format is None else [format])])
    cells = results.cells()
    if not cells:
        raise InputError(f"{results.path}: holds no finished cell; run irtrack bench first")
    text = FORMATS[path.suffix.lower().removeprefix(".")](results, cells)
    with atomic_text(path) as file:
        file.write(text)
    return path


def figures(results: Results, cells: Sequence[RunRecord]) -> Figures:
    """All figures of the cells."""
    return Figures(
        results.path.name,
        tuple(summary(cells, overall=True)),
        tuple(source_figures(each) for each in measured(results, cells)),
        severity_figures(cells),
        failures(cells),
    )


def _html(results: Results, cells: Sequence[RunRecord]) -> str:
    from irtrack.report.page import page

    return page(results, cells)


FORMATS: dict[str, Callable[[Results, Sequence[RunRecord]], str]] = {
    "html": _html,
    "json": lambda results, cells: as_json(figures(results, cells), results.runs()),
    "csv": lambda results, cells: as_csv(figures(results, cells)),
    "md": lambda results, cells: as_markdown(figures(results, cells)),
}
"""How the text of each format is made."""
