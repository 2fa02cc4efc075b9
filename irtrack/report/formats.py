"""Metrics of a report as text, JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from irsim.errors import counted
from irtrack.bench import Run, SummaryRow
from irtrack.bench.summary import MARKS, NOTHING, POSE_MARK, POSE_RULE, RANKED, RULES, percent, px, ranked_texts
from irtrack.bench.task_summary import BREAKS, SHOWN, TaskRow
from irtrack.metrics import Breaking, Survival
from irtrack.metrics.bound import LEAST_D, LEAST_SD_PX, BoundFigures
from irtrack.metrics.lost import LOSS_RULE
from irtrack.metrics.tasks import Task
from irtrack.report.figure_data import Figures, LossTable, SeverityFigures, SourceFigures, loss_tables


def lead(rows: Sequence[SummaryRow]) -> str:
    """Return the result of a ranked table in one or two sentences; `rows` in the order of their rank."""
    sentences = []
    scored = [row for row in rows if row.scored]
    if scored:
        best, worst = scored[0], scored[-1]
        sentence = f"{best.label} lost the target in {best.lost} of {counted(best.scored, 'run')}"
        sentences.append(sentence if worst is best else f"{sentence}, {worst.label} in {worst.lost} of {worst.scored}")
    elif rows:
        sentences.append("No run could be scored: there is no truth to compare with, or every run failed")
    failed = sum(row.failed for row in rows)
    if failed:
        sentences.append(f"{counted(failed, 'run')} failed")
    return ". ".join(sentences) + "." * bool(sentences)


def as_json(figures: Figures, runs: Sequence[Run]) -> str:
    """Return the metrics as one JSON document; null for an undefined or infinite value."""
    document = {
        "results": figures.results,
        "lead": lead(figures.overall),
        "loss_rule": LOSS_RULE,
        "overall": [row.as_dict() for row in figures.overall],
        "sources": [_source(source) for source in figures.sources],
        "severities": [_severity(each) for each in figures.severities],
        "tasks": [row.as_dict() for row in figures.tasks],
        "task_breaking": [each.as_dict() for each in figures.task_breaking],
        "failures": [asdict(failure) for failure in figures.failures],
        "runs": [asdict(run) for run in runs],
        **({"explanations": list(figures.explanations)} if figures.explanations else {}),
    }
    return json.dumps(_finite(document), indent=1, allow_nan=False) + "\n"


def _source(source: SourceFigures) -> dict[str, Any]:
    return {
        "source": source.name,
        "trackers": [row.as_dict() for row in source.rows],
        "attributes": {label: [asdict(row) for row in rows] for label, rows in source.attributes.items()},
        "time_to_loss": {label: _survival(held) for label, held in source.survival.items()},
        **({"bounds": {label: each.as_dict() for label, each in source.bounds.items()}} if source.bounds else {}),
    }


def _survival(held: Survival) -> dict[str, Any]:
    return {
        "frames": held.times.tolist(),
        "held": held.held.tolist(),
        "low": held.low.tolist(),
        "high": held.high.tolist(),
        "at_risk": held.at_risk.tolist(),
        "median": held.median,
    }


def severity_values(each: SeverityFigures) -> dict[str, Any]:
    """Return plain values for JSON; None for a breaking point outside the severities."""
    values: dict[str, Any] = _finite(_severity(each))
    return values


def _severity(each: SeverityFigures) -> dict[str, Any]:
    return {"source": each.family, "breaking": {label: _breaking(point) for label, point in each.breaking.items()}}


def _breaking(point: Breaking) -> dict[str, Any]:
    plain = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in asdict(point).items()}
    return {**plain, "in_words": point.in_words()}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_csv(figures: Figures) -> str:
    """Return a table with one value per line; `pandas.pivot` turns a part of the report into columns.

    Columns: part of the report, source, tracker, at (abscissa within the part), metric, value.
    """
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(["part", "source", "tracker", "at", "figure", "value"])
    writer.writerows(_lines(figures))
    return buffer.getvalue()


def _lines(figures: Figures) -> Iterator[list[object]]:
    for row in (*figures.overall, *(row for source in figures.sources for row in source.rows)):
        for name, value in row.as_dict().items():
            if name not in ("source", "label"):
                yield ["summary", row.source, row.label, "", name, _cell(value)]
    for source in figures.sources:
        for label, rows in source.attributes.items():
            for each in rows:
                for name, value in asdict(each).items():
                    if name != "attribute":
                        yield ["attribute", source.name, label, each.attribute, name, _cell(value)]
        for label, held in source.survival.items():
            for name in ("held", "low", "high", "at_risk"):
                for time, value in zip(held.times.tolist(), getattr(held, name).tolist(), strict=True):
                    yield ["time_to_loss", source.name, label, f"{time:g}", name, _cell(value)]
        for label, bound in source.bounds.items():
            for name, value in bound.as_dict().items():
                yield ["bounds", source.name, label, "", name, _cell(value)]
    for family in figures.severities:
        for label, point in family.breaking.items():
            for name in ("at", "at_low", "at_high"):
                yield ["breaking_point", family.family, label, "", name, getattr(point, name)]
            for name in ("runs", "lost", "shares", "low", "high"):
                for severity, value in zip(point.severities.tolist(), getattr(point, name).tolist(), strict=True):
                    yield ["severity", family.family, label, f"{severity:g}", name, value]
    for one in figures.tasks:
        for name, found in one.means.items():
            for part, number in zip(("mean", "low", "high"), found or (), strict=False):
                yield [one.task, one.source, one.label, part, name, _cell(_finite(number))]
    for scene in figures.task_breaking:
        for label in scene.points:
            yield ["breaking_point", scene.family, label, scene.axis, BREAKS[scene.task][0], scene.in_words(label)]
    for failure in figures.failures:
        yield ["failure", failure.source, failure.label, failure.seed, failure.brief, failure.more + 1]


def _cell(value: Any) -> Any:
    """Return a value for a CSV file: 1 and 0 for true and false, '' for None."""
    return "" if value is None else int(value) if isinstance(value, bool) else value


def as_markdown(figures: Figures) -> str:
    """Return headings and tables, for a pull request or a notebook."""
    parts = [f"# {_escaped(figures.results)}", _escaped(lead(figures.overall))]
    if len(figures.sources) > 1:
        parts += ["## All sources", _ranked(figures.overall)]
    if figures.severities:
        parts += ["## Breaking points", _breaking_points(figures.severities)]
    for losses in loss_tables(figures.severities):
        parts += [f"## Lost runs by severity: {_escaped(losses.label)}", _losses(losses)]
    for source in figures.sources:
        parts += [f"## {_escaped(source.name)}", _ranked(source.rows)]
        if source.attributes:
            parts.append(_attributes(source))
        if source.bounds:
            parts += [
                _table(BOUND_HEADS, [bound_texts(label, each) for label, each in source.bounds.items()]),
                BOUND_RULE,
            ]
    for name, task in dict.fromkeys((row.source, row.task) for row in figures.tasks):
        parts += [f"## {_escaped(name)}: {task}", _task_table(figures.tasks, name, task)]
    for each in figures.task_breaking:
        rule = f"{each.axis} at which {BREAKS[each.task][1]} in half of the runs"
        table = _table(("", rule), [(label, each.in_words(label)) for label in each.points])
        parts += [f"## {_escaped(each.family)}: {each.task}, breaking points", table]
    if figures.failures:
        parts.append("## Failures")
        parts.append(
            _table(
                ("tracker", "source", "seed", "cells", "error"),
                [(each.label, each.source, each.seed, each.more + 1, each.brief) for each in figures.failures],
            )
        )
    parts += [LOSS_RULE, *(f"{MARKS[standing]} {rule}" for standing, rule in RULES.items())]
    if any("pose" in row.needs for row in figures.overall):
        parts.append(_escaped(f"{POSE_MARK} {POSE_RULE}"))
    return "\n\n".join(filter(None, parts)) + "\n"


BOUND_HEADS = ("tracker", "runs", "lost", "frames", "rms / bound", "95 %", "bias x, y, px", "spread x, y, px")
"""Column heads of the table of errors against the bound."""

BOUND_RULE = (
    "rms / bound: root mean square error over the least standard deviation that the pixels of one frame allow (Cramér "
    f"and Rao), in frames before the loss with d of {LEAST_D:g} and a bound of {LEAST_SD_PX:g} px or more; a tracker "
    "that filters over time may be below 1."
)


def bound_texts(label: str, each: BoundFigures) -> tuple[str, ...]:
    """Return the texts of a row under BOUND_HEADS."""
    known = each.bias_x is not None and each.bias_y is not None
    return (
        label,
        str(each.runs),
        percent(each.lost_share),
        str(each.frames),
        px(each.ratio),
        NOTHING if each.low is None else f"{px(each.low)} to {px(each.high)}",
        f"{px(each.bias_x)}, {px(each.bias_y)}" if known else NOTHING,
        f"{px(each.spread_x)}, {px(each.spread_y)}" if known else NOTHING,
    )


def _task_table(rows: Sequence[TaskRow], source: str, task: Task) -> str:
    shown = SHOWN[task]
    own = [row for row in rows if (row.source, row.task) == (source, task)]
    means = [[NOTHING if (found := row.means[name]) is None else f"{found[0]:.3g}" for name in shown] for row in own]
    pairs = zip(own, means, strict=True)
    table = [(f"{row.rank}{MARKS[row.standing]}", row.label, row.runs, *texts) for row, texts in pairs]
    return _table(("", "tracker" if task == "many" else "detector", "runs", *shown), table)


def _ranked(rows: Sequence[SummaryRow]) -> str:
    return _table(RANKED, [ranked_texts(row) for row in rows])


def _breaking_points(severities: Sequence[SeverityFigures]) -> str:
    """Return the table of severities at which half of the runs are lost, with 95 % intervals."""
    labels = sorted({label for each in severities for label in each.breaking})
    rows = [
        (each.family, *(each.breaking[label].in_words() if label in each.breaking else "–" for label in labels))
        for each in severities
    ]
    return _table(("source", *labels), rows)


def _losses(losses: LossTable) -> str:
    """Return the table of the share of lost runs of each source at each severity."""
    head = ("source", *map(str, losses.severities), "half lost at")
    shares = [[NOTHING if cell is None else percent(cell.share) for cell in row.cells] for row in losses.rows]
    return _table(head, [(row.family, *texts, row.breaks) for row, texts in zip(losses.rows, shares, strict=True)])


def _attributes(source: SourceFigures) -> str:
    """Return the table of the share of frames off target, by attribute."""
    known = {row.attribute for rows in source.attributes.values() for row in rows if row.frames}
    by_label = {
        label: {row.attribute: row for row in rows if row.attribute in known}
        for label, rows in source.attributes.items()
    }
    names = list(next(iter(by_label.values())))
    if not names:
        return "No frame has an attribute."
    return "Frames off, by attribute:\n\n" + _table(
        ("tracker", *names),
        [(label, *(percent(rows[name].off_share) for name in names)) for label, rows in by_label.items()],
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_escaped(str(cell)) for cell in line) + " |" for line in lines)


def _escaped(text: str) -> str:
    """Return text in one line of a Markdown cell: markup and cell separators are escaped."""
    flat = " ".join(text.split())
    for mark in "\\`*_[]<>|#":
        flat = flat.replace(mark, f"\\{mark}")
    return flat
