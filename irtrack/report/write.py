"""Writing a report: in any format, whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from irsim.config.base import suggestion
from irsim.config.paths import path_of
from irsim.recording.output import atomic_text, check_output
from irtrack.bench import Cell, Results, summary
from irtrack.errors import InputError
from irtrack.report.figures import Figures, failures, severity_figures, source_figures
from irtrack.report.formats import as_csv, as_json, as_markdown
from irtrack.report.measured import measured


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


def figures(results: Results, cells: Sequence[Cell]) -> Figures:
    """All figures of the cells."""
    return Figures(
        results.path.name,
        tuple(summary(cells, overall=True)),
        tuple(source_figures(each) for each in measured(results, cells)),
        severity_figures(cells),
        failures(cells),
    )


def _html(results: Results, cells: Sequence[Cell]) -> str:
    from irtrack.report.page import page

    return page(results, cells)


FORMATS: dict[str, Callable[[Results, Sequence[Cell]], str]] = {
    "html": _html,
    "json": lambda results, cells: as_json(figures(results, cells), results.runs()),
    "csv": lambda results, cells: as_csv(figures(results, cells)),
    "md": lambda results, cells: as_markdown(figures(results, cells)),
}
"""How the text of each format is made."""
