"""Summary of runs of trackers of many targets and of detectors: means over scenes with intervals, ranks, ties."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from irtrack.bench.records import RunRecord
from irtrack.bench.summary import Standing, difference, distinct, pairs, value
from irtrack.metrics import mean_interval
from irtrack.metrics.ceiling import CEILING
from irtrack.metrics.tasks import ALL_FIGURES, FIGURES_OF, RANKED_BY, Task

SHOWN: Mapping[Task, tuple[str, ...]] = {
    "many": ("gospa", "hota", "idf1", "mota", "switches", "fragments", "start_delay", "false_tracks_min", "ms_median"),
    "detect": ("pd", "false_alarms", "pd_001", "pd_01", "pd_1", "first_detection", "ms_median"),
}
"""Figures of the printed table."""


@dataclass(frozen=True, slots=True)
class TaskRow:
    """One tracker of many or detector on one source, over its runs.

    rank, standing   as of `irtrack.bench.SummaryRow`, by `irtrack.metrics.tasks.RANKED_BY`; rank 0: the ceiling
                     of detectors, which is not ranked (`irtrack.metrics.ceiling`)
    runs, failed     runs that do not repeat another, and those of them that failed
    means            by figure: mean over the runs and its 95 % interval; None where no run has the figure
    """

    source: str
    task: Task
    label: str
    rank: int
    standing: Standing
    runs: int
    failed: int
    means: Mapping[str, tuple[float, float, float] | None]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: each figure as {"mean", "low", "high"}, an open end as null."""
        means = {
            name: None if each is None else dict(zip(("mean", "low", "high"), map(_finite, each), strict=True))
            for name, each in self.means.items()
        }
        named = {
            name: getattr(self, name) for name in ("source", "task", "label", "rank", "standing", "runs", "failed")
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
            rows.append(TaskRow(source, task, label, rank, standing, len(once), failed, means))
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
    """Return the standing of the one below: by the first figure of `RANKED_BY` in which the two differ."""
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
