"""Sections of the page for trackers of many targets and for detectors: tables, identities over time, ROC curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim.types import Floats
from irtrack.bench import Results, RunRecord
from irtrack.bench.task_summary import SHOWN, TaskRow, task_summary
from irtrack.metrics.ceiling import Ceiling
from irtrack.metrics.detection import roc
from irtrack.metrics.multiple import NOBODY
from irtrack.metrics.tasks import ALL_FIGURES, Task
from irtrack.report.plots import HUES, Axis, Line, LineStyle, line_chart
from irtrack.report.repeat import run_command

NOTHING = "–"
RATES = np.geomspace(1e-2, 1e2, 60)
"""False alarms a frame at which ROC curves are drawn."""


@dataclass(frozen=True)
class Span:
    """Stretch of frames in which a target has one track; x, width in percent of the run."""

    x: float
    width: float
    color: str
    title: str


@dataclass(frozen=True)
class Switch:
    """Frame in which a target changes its track."""

    x: float
    frame: int
    title: str


@dataclass(frozen=True)
class Lane:
    """One target over time: its tracks, and where it changes them."""

    target: str
    spans: tuple[Span, ...]
    switches: tuple[Switch, ...]


@dataclass(frozen=True)
class Identities:
    """Identities of one run of one tracker; `command` repeats it."""

    label: str
    seed: int
    lanes: tuple[Lane, ...]
    command: str


@dataclass(frozen=True)
class TaskSection:
    """Table, and a chart for each tracker, of one source and task.

    head, rows   texts of the table
    roc          chart of all detectors, as SVG; empty for trackers
    """

    source: str
    task: Task
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    labels: tuple[str, ...]
    identities: tuple[Identities, ...]
    roc: str


def task_sections(results: Results, cells: Sequence[RunRecord], styles: Mapping[str, LineStyle]) -> list[TaskSection]:
    """Return a section for each source and task other than single."""
    rows = task_summary(cells)
    sections = []
    for source, task in dict.fromkeys((row.source, row.task) for row in rows):
        own = [row for row in rows if (row.source, row.task) == (source, task)]
        members = [cell for cell in cells if cell.source == source and cell.key.task == task and cell.status == "ok"]
        shown = SHOWN[task]
        units = (f", {ALL_FIGURES[name].unit}" if ALL_FIGURES[name].unit else "" for name in shown)
        sections.append(
            TaskSection(
                source=source,
                task=task,
                head=("", "Runs", *(f"{name}{unit}" for name, unit in zip(shown, units, strict=True))),
                rows=tuple(_texts(row, shown) for row in own),
                labels=tuple(row.label for row in own),
                identities=tuple(_identities(results, own, members)) if task == "many" else (),
                roc=_roc_chart(results, own, members, styles, source) if task == "detect" else "",
            )
        )
    return sections


def _texts(row: TaskRow, shown: Sequence[str]) -> tuple[str, ...]:
    texts = []
    for name in shown:
        found = row.means[name]
        if found is None:
            texts.append(NOTHING)
        else:
            mean, low, high = found
            texts.append(f"{mean:.3g} ({low:.3g} to {high:.3g})" if np.isfinite(low) else f"{mean:.3g}")
    runs = f"{row.runs} ({row.failed} failed)" if row.failed else str(row.runs)
    if row.rank == 0:
        return ("ceiling", runs, *texts)
    return (f"{row.rank}{ {'told': '', 'tie': '=', 'too few': '?'}[row.standing] }", runs, *texts)


def _identities(results: Results, rows: Sequence[TaskRow], cells: Sequence[RunRecord]) -> list[Identities]:
    """Return the identities of the first run of each tracker in the scene seed that they share."""
    sources = results.sources()
    found = []
    for row in rows:
        own = [cell for cell in cells if cell.label == row.label]
        arrays = results.arrays(own[0].key) if own else None
        if arrays is not None and "matches" in arrays:
            command = run_command(own[0], sources[own[0].source, own[0].key.source_hash])
            lanes = identity_lanes(arrays["matches"], arrays["present"], arrays["names"].tolist(), arrays["frames"])
            found.append(Identities(row.label, own[0].key.tracker_seed, lanes, command))
    return found


def identity_lanes(
    matches: np.ndarray, present: np.ndarray, names: Sequence[str], frames: np.ndarray
) -> tuple[Lane, ...]:
    """Return a lane for each target from the tracks (k, n) that it has, `NOBODY` where none; present (k, n)."""
    count = max(len(matches), 1)
    order = list(dict.fromkeys(matches[matches != NOBODY].tolist()))
    colors = {track: HUES[place % len(HUES)] for place, track in enumerate(order)}
    lanes = []
    for column, name in enumerate(names):
        track, spans, switches, last = matches[:, column], [], [], NOBODY
        edges = np.flatnonzero(np.diff(track)) + 1
        for start, stop in zip([0, *edges.tolist()], [*edges.tolist(), len(track)], strict=True):
            own = int(track[start]) if len(track) else NOBODY
            if own == NOBODY:
                continue
            title = f"{name}: track {own}, frames {frames[start]} to {frames[stop - 1]}"
            spans.append(Span(100 * start / count, 100 * (stop - start) / count, colors[own], title))
            if last not in (NOBODY, own):
                place = int(frames[start])
                switches.append(Switch(100 * start / count, place, f"frame {place}: track {last} to {own}"))
            last = own
        if present[:, column].any():
            lanes.append(Lane(name, tuple(spans), tuple(switches)))
    return tuple(lanes)


def _roc_chart(
    results: Results,
    rows: Sequence[TaskRow],
    cells: Sequence[RunRecord],
    styles: Mapping[str, LineStyle],
    source: str,
) -> str:
    """Draw the mean ROC of each detector over its runs, with the 95 % interval of the mean."""
    from irtrack.metrics import mean_interval

    lines = []
    for row in rows:
        curves = []
        for cell in cells:
            arrays = results.arrays(cell.key) if cell.label == row.label else None
            if arrays is not None and len(arrays.get("d2", ())):
                curves.append(Ceiling(arrays["d2"], arrays["share"]).pd_at(RATES))
            elif arrays is not None and len(arrays.get("target_score", ())):
                curves.append(_at_rates(*roc(arrays["target_score"], arrays["false_score"], len(arrays["frames"]))))
        if curves:
            mean, low, high = mean_interval(np.array(curves))
            one = len(curves) == 1
            lines.append(Line(styles[row.label], RATES, mean, None if one else low, None if one else high))
    if not lines:
        return ""
    x, y = Axis("false alarms a frame", (RATES[0], RATES[-1]), log=True), Axis("probability of detection", (0, 1.02))
    return line_chart(lines, x, y, size=(960, 300), name=f"ROC on {source}")


def _at_rates(rates: Floats, found: Floats) -> Floats:
    """Return the probability of detection at `RATES`: that of the largest rate that is not above."""
    return np.asarray(found[np.maximum(np.searchsorted(rates, RATES, side="right") - 1, 0)])
