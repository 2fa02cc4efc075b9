"""The report: one HTML file that needs nothing else, written whole or not at all."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from irsim.files import check_output, replacing_text
from irtrack.bench import Results, Run, SummaryRow, summary
from irtrack.errors import InputError
from irtrack.metrics.loss import LOSS_RULE
from irtrack.report.palette import looks
from irtrack.report.sections import failures, sections


def write_report(results: Results | str | Path, out: str | Path | None = None) -> Path:
    """Write the report of a results file and return its path.

    results  an open results file or its path;  out  report.html beside it where not given

    InputError where there is no such results file, nothing in it, or no folder to write to.
    """
    if not isinstance(results, Results):
        with Results(results) as opened:
            return write_report(opened, out)
    path = results.path.with_name("report.html") if out is None else Path(out)
    check_output(path, results.path)
    text = page(results)
    with replacing_text(path) as file:
        file.write(text)
    return path


def page(results: Results) -> str:
    """The report as HTML text."""
    cells = results.cells()
    if not cells:
        raise InputError(f"{results.path}: holds no finished cell; run irtrack bench first")
    overall = summary(cells, overall=True)
    # Colours by name, not by rank: a tracker keeps its own from report to report.
    by_label = looks(sorted({cell.label for cell in cells}))
    environment = Environment(
        loader=PackageLoader("irtrack", "report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"px": px, "share": share, "percent": percent, "ms": ms}
    runs = results.runs()
    return environment.get_template("page.html.j2").render(
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        results=results.path.name,
        lead=lead(overall),
        overall=overall,
        looks=by_label,
        sections=sections(results, cells, by_label),
        failures=failures(cells),
        loss_rule=LOSS_RULE,
        runs=runs,
        versions=_versions(runs),
    )


def lead(rows: list[SummaryRow]) -> str:
    """The outcome in a sentence or two; rows in the order of their rank."""
    sentences = []
    scored = [row for row in rows if row.scored]
    if scored:
        best, worst = scored[0], scored[-1]
        sentence = f"{best.label} lost the target in {best.lost} of {best.scored} runs"
        sentences.append(sentence if worst is best else f"{sentence}, {worst.label} in {worst.lost} of {worst.scored}")
    else:
        sentences.append("No run could be scored: there is no truth to compare with, or every run failed")
    failed = sum(row.failed for row in rows)
    if failed:
        sentences.append(f"{failed} run{'s' if failed > 1 else ''} failed")
    return ". ".join(sentences) + "."


def _versions(runs: list[Run]) -> str:
    """What the newest run was made with."""
    return ", ".join(f"{name} {version}" for name, version in runs[-1].versions.items()) if runs else ""


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
