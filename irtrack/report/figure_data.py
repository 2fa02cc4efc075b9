"""Metrics of a results file: of each source, over all sources, by severity; failures. All formats print them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from irtrack.bench import Results, RunRecord, SourceRow, SummaryRow, distinct, summary
from irtrack.bench.task_summary import TaskBreaking, TaskRow, task_breaking, task_summary
from irtrack.metrics import AttributeRow, Breaking, Survival, Trace, breaking_point, by_attribute, kaplan_meier
from irtrack.metrics.bound import BoundFigures, TargetBound, bound_figures


@dataclass(frozen=True, eq=False)
class Measured:
    """Run records of one source; traces of the runs that did not fail, and bounds of their targets where the results
    file has them, both by position of the record."""

    cells: tuple[RunRecord, ...]
    tracks: Mapping[int, Trace]
    rows: Mapping[tuple[str, str], SourceRow]
    bounds: Mapping[int, TargetBound] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.cells[0].source

    @cached_property
    def traces(self) -> dict[str, list[Trace]]:
        """Traces by label of the tracker, without runs that repeat another run."""
        found: dict[str, list[Trace]] = {}
        for place in self._once:
            found.setdefault(self.cells[place].label, []).append(self.tracks[place])
        return found

    @cached_property
    def bounded(self) -> dict[str, tuple[list[Trace], list[TargetBound]]]:
        """Traces with a bound and their bounds by label of the tracker, without runs that repeat another run."""
        found: dict[str, tuple[list[Trace], list[TargetBound]]] = {}
        for place in self._once:
            if place in self.bounds:
                traces, bounds = found.setdefault(self.cells[place].label, ([], []))
                traces.append(self.tracks[place])
                bounds.append(self.bounds[place])
        return found

    @cached_property
    def _once(self) -> list[int]:
        """Positions of the traces, without runs that repeat another run."""
        once = {(cell.label, cell.key) for cell in distinct(self.cells)}
        return [place for place in self.tracks if (self.cells[place].label, self.cells[place].key) in once]

    @cached_property
    def shown(self) -> tuple[int, ...]:
        """Positions of the records whose runs are shown in pictures: those with the seeds that have the most losses."""
        by_seed: defaultdict[tuple[int, str], list[int]] = defaultdict(list)
        for place, cell in enumerate(self.cells):
            by_seed[cell.key.tracker_seed, cell.key.source_hash].append(place)
        worst = min(by_seed, key=lambda seed: (-self._lost(by_seed[seed]), seed))
        return tuple(by_seed[worst])

    def _lost(self, places: Sequence[int]) -> int:
        return sum(cell.score is not None and cell.score.lost is True for cell in map(self.cells.__getitem__, places))

    def row(self, cell: RunRecord) -> SourceRow:
        """Return the source of a run, with the scene seed of the run."""
        return self.rows[cell.source, cell.key.source_hash]

    @property
    def source(self) -> SourceRow:
        """Source with the scene seed of the pictures."""
        return self.row(self.cells[self.shown[0]])


def measured(results: Results, cells: Sequence[RunRecord]) -> Iterator[Measured]:
    """Yield the runs of each source, sorted by name, with their traces; only one source is in memory at a time."""
    by_name: defaultdict[str, list[RunRecord]] = defaultdict(list)
    for cell in cells:
        by_name[cell.source].append(cell)
    rows = results.sources()
    for _, members in sorted(by_name.items()):
        tracks = {place: trace for place, cell in enumerate(members) if (trace := results.trace(cell.key)) is not None}
        bounds = {place: bound for place in tracks if (bound := _bound(results, members[place])) is not None}
        yield Measured(tuple(members), tracks, rows, bounds)


def _bound(results: Results, cell: RunRecord) -> TargetBound | None:
    return None if cell.key.target is None else results.bounds(cell.key.source_hash, cell.key.target)


@dataclass(frozen=True, eq=False)
class SourceFigures:
    """Metrics of one source.

    rows         ranked table
    attributes   metrics in the frames with each attribute, by label
    survival     share of runs without loss against frames after the start, by label; no entry without truth
    bounds       errors against the bound, by label; empty where the results file has no bounds of the source
    """

    name: str
    rows: tuple[SummaryRow, ...]
    attributes: Mapping[str, tuple[AttributeRow, ...]]
    survival: Mapping[str, Survival]
    bounds: Mapping[str, BoundFigures] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class SeverityFigures:
    """Breaking point of each tracker, by label, of a scenario at several severities."""

    family: str
    breaking: Mapping[str, Breaking]


@dataclass(frozen=True)
class Failure:
    """Failed run with its error text; `more`: number of further runs of this tracker and source with the same error."""

    label: str
    source: str
    seed: int
    error: str
    more: int

    @property
    def brief(self) -> str:
        """Last line of the error text, which states the exception."""
        return self.error.strip().splitlines()[-1] if self.error.strip() else "no error text"


@dataclass(frozen=True, eq=False)
class Figures:
    """Metrics of a results file; `overall`: ranked table over all sources.

    tasks, task_breaking   of trackers of many and detectors; the rest is of trackers of one target
    explanations           of lost runs, see `irtrack.explain.Explanation.as_dict`
    """

    results: str
    overall: tuple[SummaryRow, ...]
    sources: tuple[SourceFigures, ...]
    severities: tuple[SeverityFigures, ...]
    failures: tuple[Failure, ...]
    tasks: tuple[TaskRow, ...] = ()
    task_breaking: tuple[TaskBreaking, ...] = ()
    explanations: tuple[Mapping[str, Any], ...] = ()


def figures(results: Results, cells: Sequence[RunRecord]) -> Figures:
    """Return all metrics of the run records."""
    single = [cell for cell in cells if cell.key.task == "single"]
    return Figures(
        results.path.name,
        tuple(summary(single, overall=True)),
        tuple(source_figures(each) for each in measured(results, single)),
        severity_figures(single),
        failures(cells),
        tuple(task_summary(cells)),
        task_breaking(cells, results.sources()),
        tuple(values for cell in single if (values := results.explanation(cell.key)) is not None),
    )


def source_figures(measured: Measured) -> SourceFigures:
    """Return the metrics of one source."""
    traces = measured.traces
    with_truth = {label: [trace for trace in each if trace.scored.any()] for label, each in traces.items()}
    return SourceFigures(
        name=measured.name,
        rows=tuple(summary(measured.cells)),
        attributes={label: tuple(by_attribute(each)) for label, each in with_truth.items() if each},
        survival={label: survival(each) for label, each in with_truth.items() if each},
        bounds={label: bound_figures(*each) for label, each in measured.bounded.items()},
    )


def survival(traces: Sequence[Trace]) -> Survival:
    """Return the share of tracks without loss against frames after the start."""
    lost = [trace.lost_position for trace in traces]
    ended = [len(trace.indices) - 1 if at is None else at for trace, at in zip(traces, lost, strict=True)]
    return kaplan_meier(ended, [at is not None for at in lost])


def severity_figures(cells: Sequence[RunRecord]) -> tuple[SeverityFigures, ...]:
    """Return the breaking points of every scenario run at two severities or more; a failed run counts as lost."""
    families: defaultdict[str, defaultdict[str, list[RunRecord]]] = defaultdict(lambda: defaultdict(list))
    for cell in distinct(cells):
        if cell.severity is not None and (cell.score is None or cell.score.lost is not None):
            families[cell.family][cell.label].append(cell)
    found = []
    for family, labels in sorted(families.items()):
        if len({cell.severity for members in labels.values() for cell in members}) < 2:
            continue
        points = {label: _breaking(members) for label, members in sorted(labels.items())}
        found.append(SeverityFigures(family, {label: point for label, point in points.items() if point}))
    return tuple(found)


def _breaking(cells: Sequence[RunRecord]) -> Breaking | None:
    severities = [float(cell.severity or 0) for cell in cells]
    return breaking_point(severities, [cell.lost_or_failed for cell in cells])


def failures(cells: Sequence[RunRecord]) -> tuple[Failure, ...]:
    """Return the failed runs, one for each tracker, source and error."""
    alike: defaultdict[tuple[str, str, str], list[RunRecord]] = defaultdict(list)
    for cell in cells:
        if cell.status == "failed":
            last_line = (cell.failure or "").strip().rpartition("\n")[2]
            alike[cell.label, cell.source, last_line].append(cell)
    return tuple(
        Failure(label, source, members[0].key.tracker_seed, members[0].failure or "", len(members) - 1)
        for (label, source, _), members in alike.items()
    )


@dataclass(frozen=True)
class Losses:
    """Numbers of runs in one cell of the table, and of lost or failed runs among them."""

    runs: int
    lost: int

    @property
    def share(self) -> float:
        return self.lost / self.runs


@dataclass(frozen=True)
class LossRow:
    """Row of one source: its losses at each severity, None without runs; the breaking point in words."""

    family: str
    cells: tuple[Losses | None, ...]
    breaks: str


@dataclass(frozen=True)
class LossTable:
    """Lost runs of one tracker: the columns are rising severities, and each row is a source."""

    label: str
    severities: tuple[int, ...]
    rows: tuple[LossRow, ...]


def loss_tables(families: Sequence[SeverityFigures]) -> tuple[LossTable, ...]:
    """Return a table of lost runs for each tracker, by label; none for a single source, whose failure curve suffices.

    If the sources vary a second cause of failure, as in `suites/occlusion-suite` (sources: fraction occluded,
    severities: duration), the table shows both causes.
    """
    if len(families) < 2:
        return ()
    points = [point for each in families for point in each.breaking.values()]
    severities = sorted({int(severity) for point in points for severity in point.severities})
    labels = sorted({label for each in families for label in each.breaking})
    return tuple(
        LossTable(
            label,
            tuple(severities),
            tuple(
                _loss_row(each.family, each.breaking[label], severities) for each in families if label in each.breaking
            ),
        )
        for label in labels
    )


def _loss_row(family: str, point: Breaking, severities: Sequence[int]) -> LossRow:
    found = {
        int(severity): Losses(int(runs), int(lost))
        for severity, runs, lost in zip(point.severities, point.runs, point.lost, strict=True)
    }
    return LossRow(family, tuple(map(found.get, severities)), point.in_words())
