"""Chapters of the page for trackers of many targets and for detectors: tables, charts, identities, replays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from irsim import IrsimError
from irsim.types import Source
from irtrack.bench import Results, RunRecord
from irtrack.bench.summary import value
from irtrack.bench.task_summary import BREAKS, SHOWN, TaskBreaking, TaskRow, task_breaking, task_summary
from irtrack.metrics.multiple import NOBODY
from irtrack.metrics.statistics import HALF
from irtrack.metrics.tasks import ALL_FIGURES, RANKED_BY, Task
from irtrack.report.line_styles import LineStyle
from irtrack.report.plots import Axis, Line, line_chart
from irtrack.report.repeat import reopen, run_command
from irtrack.report.task_figures import RATES, RULES, ConditionRow, by_condition, first_detections, roc_band
from irtrack.report.task_pictures import ManyReplay, ManyTracks, SwitchFrame, many_replay, switch_frames

NOTHING = "–"
REPLAY_BYTES = 700_000
"""Largest size of the pictures of one replay, bytes."""
SWITCHES = 6
"""Largest number of frames with a switch that are shown of one run."""


@dataclass
class TaskBudget:
    """Numbers of replays and of pictures of switches that may still be added to a page."""

    replays: int = 8
    switches: int = 48
    sources: dict[str, Source | None] = field(default_factory=dict)


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
    """Worst run of one tracker: its identities over time, its switches, a replay; `command` repeats it.

    figures  the figures by which it is the worst, in words
    prefix   of the element ids of the frames of switches;  frames  those that are shown
    note     the reason where there are no pictures
    """

    label: str
    seed: int
    figures: str
    lanes: tuple[Lane, ...]
    command: str
    prefix: str
    frames: tuple[SwitchFrame, ...] = ()
    replay: ManyReplay | None = None
    note: str = ""

    def link(self, switch: Switch) -> str:
        """Return the link to the picture of a switch within the page; '' where it is not shown."""
        return f"#{self.prefix}-{switch.frame}" if any(each.index == switch.frame for each in self.frames) else ""


@dataclass(frozen=True)
class TaskSection:
    """Table, and charts and pictures, of one source and task.

    head, rows   texts of the table
    roc, first   charts of all detectors, as SVG; empty for trackers
    conditions   found targets of each condition, by label of the detector
    """

    source: str
    task: Task
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    labels: tuple[str, ...]
    identities: tuple[Identities, ...] = ()
    roc: str = ""
    first: str = ""
    conditions: Mapping[str, tuple[ConditionRow, ...]] = field(default_factory=dict)

    @property
    def condition_names(self) -> list[str]:
        """Conditions that some target meets."""
        known = {row.condition for rows in self.conditions.values() for row in rows}
        return [name for name in RULES if name in known]


@dataclass(frozen=True)
class TaskChapter:
    """One task of a source, or of a scenario at all of its severities.

    breaking, curves   its breaking points and their chart; None and '' without severities
    section, others    with charts and pictures; at the other severities, tables only
    """

    name: str
    task: Task
    breaking: TaskBreaking | None
    curves: str
    section: TaskSection
    others: tuple[TaskSection, ...]

    @property
    def rule(self) -> str:
        """Rule by which a run breaks, in words."""
        return BREAKS[self.task][1]


def task_chapters(results: Results, cells: Sequence[RunRecord], styles: Mapping[str, LineStyle]) -> list[TaskChapter]:
    """Return a chapter for each source, or scenario with severities, and task other than single."""
    rows = task_summary(cells)
    families = {(each.family, each.task): each for each in task_breaking(cells, results.sources())}
    places: dict[tuple[str, Task], dict[str, int]] = {}
    for cell in cells:
        if cell.key.task != "single":
            family = cell.family if (cell.family, cell.key.task) in families else cell.source
            places.setdefault((family, cell.key.task), {})[cell.source] = cell.severity or 0
    budget = TaskBudget()
    chapters = []
    for number, ((name, task), sources) in enumerate(places.items()):
        found = families.get((name, task))
        main = _main_severity(found) if found else next(iter(sources.values()))
        order = sorted(sources, key=lambda source: (sources[source] != main, sources[source]))
        made = []
        for source in order:
            own = [row for row in rows if (row.source, row.task) == (source, task)]
            members = [cell for cell in cells if (cell.source, cell.key.task, cell.status) == (source, task, "ok")]
            made.append(_section(results, own, members, styles, budget if source == order[0] else None, number))
        curves = _breaking_chart(found, styles) if found else ""
        chapters.append(TaskChapter(name, task, found, curves, made[0], tuple(made[1:])))
    return chapters


def _main_severity(found: TaskBreaking) -> int:
    """Return the least severity at which half of all runs break, else the highest."""
    for place, severity in enumerate(found.severities):
        x = -found.x[place] if found.falls else found.x[place]
        at = [(p.lost[k], p.runs[k]) for p in found.points.values() for k in np.flatnonzero(p.severities == x)]
        if sum(lost for lost, _ in at) >= HALF * sum(runs for _, runs in at):
            return severity
    return found.severities[-1]


def _breaking_chart(found: TaskBreaking, styles: Mapping[str, LineStyle]) -> str:
    sign = -1.0 if found.falls else 1.0
    return line_chart(
        [Line(styles[label], sign * p.severities, p.shares, p.low, p.high) for label, p in found.points.items()],
        Axis(found.axis, (found.x[0], found.x[-1]), ticks=found.x),
        Axis("share of runs broken", (0, 1.02)),
        size=(460, 260),
        name=f"{found.family}, {found.task}: breaking points",
        level=HALF,
    )


def _section(
    results: Results,
    rows: Sequence[TaskRow],
    cells: Sequence[RunRecord],
    styles: Mapping[str, LineStyle],
    budget: TaskBudget | None,
    number: int,
) -> TaskSection:
    """Return the section of one source and task; with `budget` None it has the table only."""
    task, source = rows[0].task, rows[0].source
    shown = SHOWN[task]
    units = (f", {ALL_FIGURES[name].unit}" if ALL_FIGURES[name].unit else "" for name in shown)
    head = ("", "Runs", *(f"{name}{unit}" for name, unit in zip(shown, units, strict=True)))
    texts, labels = tuple(_texts(row, shown) for row in rows), tuple(row.label for row in rows)
    if budget is None:
        return TaskSection(source, task, head, texts, labels)
    if task == "many":
        worst = tuple(_identities(results, rows, cells, budget, number))
        return TaskSection(source, task, head, texts, labels, worst)
    runs = {
        label: [each for cell in cells if cell.label == label and (each := results.arrays(cell.key)) is not None]
        for label in labels
    }
    conditions = {label: found for label in labels if (found := by_condition(runs[label]))}
    charts = _roc_chart(runs, styles, source), _first_chart(runs, styles, source)
    return TaskSection(source, task, head, texts, labels, (), *charts, conditions)


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


def _identities(
    results: Results, rows: Sequence[TaskRow], cells: Sequence[RunRecord], budget: TaskBudget, number: int
) -> Iterable[Identities]:
    """Yield the worst run of each tracker, by `irtrack.metrics.tasks.RANKED_BY`."""
    sources = results.sources()
    for place, row in enumerate(rows):
        own = [cell for cell in cells if cell.label == row.label]
        cell = min(own, key=_quality, default=None)
        arrays = None if cell is None else results.arrays(cell.key)
        if cell is None or arrays is None or "matches" not in arrays:
            continue
        tracks = ManyTracks.of(arrays)
        source = sources[cell.source, cell.key.source_hash]
        prefix = f"switch-{number}-{place}"
        figures = ", ".join(f"{name} {value(cell, name):.3g}" for name in RANKED_BY["many"])
        lanes = identity_lanes(tracks.matches, tracks.present, tracks.names, tracks.frames)
        frames: tuple[SwitchFrame, ...] = ()
        replay, note = None, ""
        try:
            if source.hash not in budget.sources:
                opened = reopen(source)
                budget.sources = {source.hash: opened if opened.hash == source.hash else None}
            opened_source = budget.sources[source.hash]
            if opened_source is None:
                note = "No pictures: the source has changed since it was measured."
            else:
                frames = switch_frames(opened_source, tracks, prefix, min(SWITCHES, budget.switches))
                budget.switches -= len(frames)
                if budget.replays and len(tracks.frames):
                    replay = many_replay(opened_source, tracks, REPLAY_BYTES)
                    budget.replays -= 1
        except IrsimError as error:
            note = f"No pictures: the source cannot be opened any more ({error})."
        command = run_command(cell, source)
        yield Identities(row.label, cell.key.tracker_seed, figures, lanes, command, prefix, frames, replay, note)


def _quality(cell: RunRecord) -> tuple[float, ...]:
    """Return a value that is least for the worst run; an unknown figure counts as good."""
    signs = (-1.0 if ALL_FIGURES[name].better == "less" else 1.0 for name in RANKED_BY["many"])
    found = (sign * value(cell, name) for sign, name in zip(signs, RANKED_BY["many"], strict=True))
    return tuple(np.inf if np.isnan(each) else each for each in found)


def identity_lanes(
    matches: np.ndarray, present: np.ndarray, names: Sequence[str], frames: np.ndarray
) -> tuple[Lane, ...]:
    """Return a lane for each target from the tracks (k, n) that it has, `NOBODY` where none; present (k, n)."""
    count = max(len(matches), 1)
    empty = np.zeros(0)
    colors = {
        track: style.color
        for track, style in ManyTracks(frames, matches, present, (), empty, empty, empty, empty, empty).styles().items()
    }
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


Runs = Mapping[str, Sequence[Mapping[str, np.ndarray]]]
"""Arrays of the runs of each detector, by label."""


def _roc_chart(runs: Runs, styles: Mapping[str, LineStyle], source: str) -> str:
    lines = []
    for label, each in runs.items():
        band = roc_band(each)
        if band is not None:
            mean, low, high = band
            lines.append(Line(styles[label], RATES, mean, *((low, high) if len(each) > 1 else (None, None))))
    if not lines:
        return ""
    x, y = Axis("false alarms a frame", (RATES[0], RATES[-1]), log=True), Axis("probability of detection", (0, 1.02))
    return line_chart(lines, x, y, size=(560, 300), name=f"ROC on {source}")


def _first_chart(runs: Runs, styles: Mapping[str, LineStyle], source: str) -> str:
    found = {label: held for label, each in runs.items() if (held := first_detections(each)) is not None}
    if not found:
        return ""
    last = max(*(held.times[-1] for held in found.values() if len(held.times)), 1.0, 1.0)
    lines = []
    for label, held in found.items():
        x = np.repeat(np.concatenate([[0.0], held.times, [last]]), 2)[1:-1]
        y, low, high = (1 - np.repeat(np.concatenate([[1.0], each]), 2) for each in (held.held, held.high, held.low))
        lines.append(Line(styles[label], x, y, low, high))
    x_axis, y_axis = Axis("frames from the target's first", (0, float(last))), Axis("share detected", (0, 1.02))
    return line_chart(lines, x_axis, y_axis, size=(560, 300), name=f"time to first detection on {source}")
