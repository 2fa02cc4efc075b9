"""Report as one HTML page without external files."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.resources import files

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from irtrack.bench import Results, Run, RunRecord, summary
from irtrack.bench.summary import MARKS, POSE_MARK, POSE_RULE, RULES, ms, percent, px, share
from irtrack.metrics import ATTRIBUTES
from irtrack.metrics.lost import LOSS_RULE
from irtrack.report.explained import cause_table, explained_losses
from irtrack.report.figure_data import failures, loss_tables, measured, severity_figures
from irtrack.report.formats import BOUND_HEADS, BOUND_RULE, bound_texts, lead
from irtrack.report.frames import gallery
from irtrack.report.line_styles import styles
from irtrack.report.repeat import repeat_commands
from irtrack.report.sections import Budget, chapters
from irtrack.report.task_sections import task_chapters

SCRIPT = (files("irtrack.report") / "page.js").read_text()
"""Script of the page; it plays the replays."""


def page(results: Results, cells: Sequence[RunRecord]) -> str:
    """Return the report as HTML text."""
    # Colours by label, not by rank: a tracker keeps its colour from report to report.
    by_label = styles(sorted({cell.label for cell in cells}))
    posed = {cell.label for cell in cells if "pose" in cell.needs}
    tasks, failed = task_chapters(results, cells, by_label), failures(cells)
    cells = [cell for cell in cells if cell.key.task == "single"]
    severities = severity_figures(cells)
    found = chapters(measured(results, cells), severities, by_label, Budget())
    overall = summary(cells, overall=True)
    losses, lost_pairs = gallery(results, cells, by_label)
    explained = explained_losses(results, cells, by_label)
    causes, cause_rows = cause_table(explained)
    runs = results.runs()
    return render(
        "page.html.j2",
        results=results.path.name,
        overall=overall,
        lead=lead(overall) if overall else "",
        styles=by_label,
        loss_tables=loss_tables(severities),
        chapters=found,
        task_chapters=tasks,
        has_replay=any(chapter.section.pictures.replay for chapter in found)
        or any(each.replay for chapter in tasks for each in chapter.section.identities),
        failures=failed,
        losses=losses,
        explained=explained,
        causes=causes,
        cause_rows=cause_rows,
        lost_pairs=lost_pairs,
        attributes=ATTRIBUTES,
        bound_heads=BOUND_HEADS,
        bound_rule=BOUND_RULE,
        bound_texts=bound_texts,
        loss_rule=LOSS_RULE,
        marks=MARKS,
        rules=RULES,
        posed=posed,
        pose_mark=POSE_MARK,
        pose_rule=POSE_RULE,
        runs=runs,
        commands=repeat_commands(results.path, runs),
        versions=versions(runs),
    )


def render(template: str, folder: str = "report", **values: object) -> str:
    """Return a filled template as HTML text; `folder`: subfolder of irtrack with the template, which may include
    others."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("irtrack", each) for each in (folder, "report")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"px": px, "share": share, "percent": percent, "ms": ms}
    return environment.get_template(template).render(
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        script=SCRIPT,
        script_hash=base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode(),
        **values,
    )


def versions(runs: list[Run]) -> str:
    """Return the versions of libraries in the newest call of the bench, as text."""
    return ", ".join(f"{name} {version}" for name, version in runs[-1].versions.items()) if runs else ""
