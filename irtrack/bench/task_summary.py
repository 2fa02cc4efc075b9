"""Summary of runs of trackers of many targets and of detectors: means over scenes with intervals, ranks, ties."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

import numpy as np

from irsim import IrsimError, loads
from irtrack.bench.records import RunRecord, SourceRow
from irtrack.bench.summary import Standing, difference, distinct, pairs, value
from irtrack.metrics import Breaking, breaking_point, mean_interval
from irtrack.metrics.ceiling import CEILING
from irtrack.metrics.statistics import HALF
from irtrack.metrics.tasks import ALL_FIGURES, FIGURES_OF, RANKED_BY, Task

SHOWN: Mapping[Task, tuple[str, ...]] = {
    "many": ("gospa", "hota", "idf1", "mota", "switches", "fragments", "start_delay", "false_tracks_min", "ms_median"),
    "detect": ("pd", "false_alarms", "pd_001", "pd_01", "pd_1", "first_detection", "ms_median"),
}
"""Figures in the printed table, by task."""

BREAKS: Mapping[Task, tuple[str, str]] = {
    "many": ("kept", "at most half of the targets keep one track"),
    "detect": ("pd_1", "at most half of the targets are found at 1 false alarm a frame"),
}
"""Figure by which a run breaks, at one half or less, and the rule in words. A failed run breaks too."""


@dataclass(frozen=True, slots=True)
class TaskRow:
    """One tracker of many or detector on one source, over its runs.

    rank, standing   as in `irtrack.bench.SummaryRow`, by `irtrack.metrics.tasks.RANKED_BY`; rank 0: the ceiling
                     of detectors, which is not ranked (`irtrack.metrics.ceiling`)
    runs, failed     runs that do not repeat another, and those of them that failed
    means            by figure: mean over the runs and its 95 % interval; None where no run has the figure
    needs            what the tracker or detector gets besides pictures: "pose" or ""
    """

    source: str
    task: Task
    label: str
    rank: int
    standing: Standing
    runs: int
    failed: int
    means: Mapping[str, tuple[float, float, float] | None]
    needs: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: each figure as {"mean", "low", "high"}, an open end as null."""
        means = {
            name: None if each is None else dict(zip(("mean", "low", "high"), map(_finite, each), strict=True))
            for name, each in self.means.items()
        }
        named = {
            name: getattr(self, name)
            for name in ("source", "task", "label", "rank", "standing", "runs", "failed", "needs")
        }
        return named | {"figures": means}


def task_summary(cells: Iterable[RunRecord]) -> list[TaskRow]:
    """Return rows per source, task and label, ranked from 1; runs of one target are left out (`summary`)."""
    groups: dict[tuple[str, Task], dict[str, list[RunRecord]]] = {}
    for cell in cells:
        if cell.key.task != "single":
            groups.setdefault((cell.source, cell.key.task), {}).setdefault(cell.label, []).append(cell)
    rows = []
    for (source, task), labels in groups.items():
        ranked = sorted(labels, key=lambda label: (label != CEILING, _order(labels[label], task), label))
        for place, label in enumerate(ranked):
            rank = place + (CEILING not in labels)
            standing: Standing = "told" if rank <= 1 else _standing(labels[ranked[place - 1]], labels[label], task)
            once = distinct(labels[label])
            failed = sum(cell.status == "failed" for cell in once)
            means = {name: _mean(once, name) for name in FIGURES_OF[task]}
            rows.append(TaskRow(source, task, label, rank, standing, len(once), failed, means, " ".join(once[0].needs)))
    return rows


def _mean(cells: list[RunRecord], name: str) -> tuple[float, float, float] | None:
    values = np.array([value(cell, name) for cell in cells])
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    mean, low, high = (float(each[0]) for each in mean_interval(values[:, None]))
    if len(values) == 1:
        return mean, low, high
    least = -inf if name == "mota" else 0.0
    return mean, max(low, least), min(high, ALL_FIGURES[name].most)


def _order(cells: list[RunRecord], task: Task) -> tuple[float, ...]:
    order = []
    for name in RANKED_BY[task]:
        mean = _mean(distinct(cells), name)
        worse = 1 if ALL_FIGURES[name].better == "less" else -1
        order.append(inf if mean is None else worse * mean[0])
    return tuple(order)


def _standing(above: list[RunRecord], below: list[RunRecord], task: Task) -> Standing:
    """Return the standing of the lower row, by the first figure of `RANKED_BY` in which the two rows differ."""
    both = pairs(above, below)
    found = [(name, each) for name in RANKED_BY[task] if (each := difference(both, name)) is not None]
    if all(each.is_open for _, each in found):
        return "too few"
    telling = [(name, each) for name, each in found if not each.is_tie]
    if not telling:
        return "tie"
    name, first = telling[0]
    return "told" if (first.mean > 0) == (ALL_FIGURES[name].better == "less") else "tie"


def _finite(number: float) -> float | None:
    return number if np.isfinite(number) else None


@dataclass(frozen=True, eq=False)
class TaskBreaking:
    """Share of broken runs (`BREAKS`) of a scenario against the quantity that its severities change.

    axis         that quantity, with its unit: "targets" where they change the number of targets
    severities   the severities run;  x  the value of each, in the same order
    points       by label; their severities are x, negative where x falls as severities rise
    """

    family: str
    task: Task
    axis: str
    severities: tuple[int, ...]
    x: tuple[float, ...]
    points: Mapping[str, Breaking]

    @property
    def falls(self) -> bool:
        return self.x[-1] < self.x[0]

    def in_words(self, label: str) -> str:
        """Return the breaking point in the unit of the axis, as `irtrack.metrics.Breaking.in_words`."""
        text = self.points[label].in_words()
        return text.translate(str.maketrans("<>", "><", "-")) if self.falls else text

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON; null for a breaking point outside the severities."""
        sign = -1.0 if self.falls else 1.0
        points = {
            label: {
                "x": (sign * point.severities).tolist(),
                "runs": point.runs.tolist(),
                "broken": point.lost.tolist(),
                "low": point.low.tolist(),
                "high": point.high.tolist(),
                "at": _finite(sign * point.at),
                "in_words": self.in_words(label),
            }
            for label, point in self.points.items()
        }
        return {"source": self.family, "task": self.task, "axis": self.axis, "rule": BREAKS[self.task][1]} | points


def task_breaking(cells: Iterable[RunRecord], sources: Mapping[tuple[str, str], SourceRow]) -> tuple[TaskBreaking, ...]:
    """Return the breaking points of every scenario on which trackers of many or detectors were run at two severities or
    more.

    sources   of the results file, by (name, hash)
    """
    families: defaultdict[tuple[str, Task], list[RunRecord]] = defaultdict(list)
    for cell in distinct(cells):
        task = cell.key.task
        if cell.severity is None or task == "single":
            continue
        if cell.status == "failed" or isfinite(value(cell, BREAKS[task][0])):
            families[cell.family, task].append(cell)
    found = []
    for (family, task), members in sorted(families.items()):
        rows = {cell.severity or 0: sources[cell.source, cell.key.source_hash] for cell in members}
        levels = sorted(rows)
        if len(levels) < 2:
            continue
        axis, x = _axis([rows[level] for level in levels])
        sign = -1.0 if x[-1] < x[0] else 1.0
        place = {level: sign * each for level, each in zip(levels, x, strict=True)}
        points = {}
        for label in sorted({cell.label for cell in members}):
            own = [cell for cell in members if cell.label == label]
            broken = [cell.status == "failed" or value(cell, BREAKS[task][0]) <= HALF for cell in own]
            point = breaking_point([place[cell.severity or 0] for cell in own], broken)
            if point is not None:
                points[label] = point
        found.append(TaskBreaking(family, task, axis, tuple(levels), tuple(x), points))
    return tuple(found)


_UNITS = {"deg": "deg", "px": "px", "m": "m", "k": "K", "mk": "mK"}


def _axis(rows: Sequence[SourceRow]) -> tuple[str, list[float]]:
    """Return the quantity that the severities of a scenario change, and its values: the one key that is a number, or
    the number of targets, if it rises or falls throughout; else the severity itself."""
    severities = [float(row.severity or 0) for row in rows]
    try:
        scenarios = [loads(row.text, row.name, trusted=False) for row in rows]
    except IrsimError:
        return "severity", severities
    varied = scenarios[0].severities
    if len(varied) == 1:
        (key, values), *_ = varied.items()
        chosen = [values[row.severity or 0] for row in rows]
        if all(isinstance(each, int | float) for each in chosen):
            name, _, unit = key.rpartition(".")[2].rpartition("_")
            text = f"{name.replace('_', ' ')}, {_UNITS[unit]}" if name and unit in _UNITS else key.rpartition(".")[2]
            return _monotonic(text, [float(each) for each in chosen], severities)
    counts = [float(sum(each.id not in scenario.without for each in scenario.targets)) for scenario in scenarios]
    return _monotonic("targets", counts, severities)


def _monotonic(axis: str, x: list[float], severities: list[float]) -> tuple[str, list[float]]:
    steps = np.diff(x)
    return (axis, x) if (steps > 0).all() or (steps < 0).all() else ("severity", severities)
