"""Writing of a report in one of its formats."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from irsim.config.base import suggestion
from irsim.config.paths import path_of
from irsim.recording.output import atomic_text, check_output
from irtrack.bench import Results, RunRecord
from irtrack.errors import InputError
from irtrack.report.figure_data import figures
from irtrack.report.formats import as_csv, as_json, as_markdown


def write_report(results: Results | str | Path, out: str | Path | None = None, format: str | None = None) -> Path:
    """Write the report of a results file and return its path.

    results  open results file or its path
    out      output file; by default report.html (.json, .csv, .md) beside the results file
    format   one of `FORMATS`; by default given by the ending of `out`, else html

    InputError where the results file is missing or empty, the format is unknown, or `out` cannot be written.
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
        raise InputError(f"{results.path}: holds no finished run; run irtrack bench first")
    text = FORMATS[path.suffix.lower().removeprefix(".")](results, cells)
    with atomic_text(path) as file:
        file.write(text)
    return path


def _html(results: Results, cells: Sequence[RunRecord]) -> str:
    from irtrack.report.page import page

    return page(results, cells)


FORMATS: dict[str, Callable[[Results, Sequence[RunRecord]], str]] = {
    "html": _html,
    "json": lambda results, cells: as_json(figures(results, cells), results.runs()),
    "csv": lambda results, cells: as_csv(figures(results, cells)),
    "md": lambda results, cells: as_markdown(figures(results, cells)),
}
"""Functions by format, which return the text of a report."""
