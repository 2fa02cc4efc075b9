"""What the results file has of each source, read once for all formats."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from irtrack.bench import Results, RunRecord, SourceRow, SummaryRow, distinct, summary
from irtrack.metrics import AttributeRow, Breaking, Survival, Trace, breaking_point, by_attribute, kaplan_meier


@dataclass(frozen=True, eq=False)
class Measured:
    """The cells of one source and the tracks of those that did not fail, by place in `cells`."""

    cells: tuple[RunRecord, ...]
    tracks: Mapping[int, Trace]
    rows: Mapping[tuple[str, str], SourceRow]

    @property
    def name(self) -> str:
        return self.cells[0].source

    @cached_property
    def traces(self) -> dict[str, list[Trace]]:
        """The traces of all runs by the tracker's label; a run that repeats another is left out."""
        once = {(cell.label, cell.key) for cell in distinct(self.cells)}
        found: dict[str, list[Trace]] = {}
        for place, trace in self.tracks.items():
            cell = self.cells[place]
            if (cell.label, cell.key) in once:
                found.setdefault(cell.label, []).append(trace)
        return found

    @cached_property
    def shown(self) -> tuple[int, ...]:
        """Places of the cells that pictures are made of: one scene and seed, that in which most are lost."""
        by_seed: defaultdict[tuple[int, str], list[int]] = defaultdict(list)
        for place, cell in enumerate(self.cells):
            by_seed[cell.key.tracker_seed, cell.key.source_hash].append(place)
        worst = min(by_seed, key=lambda seed: (-self._lost(by_seed[seed]), seed))
        return tuple(by_seed[worst])

    def _lost(self, places: Sequence[int]) -> int:
        return sum(cell.score is not None and cell.score.lost is True for cell in map(self.cells.__getitem__, places))

    def row(self, cell: RunRecord) -> SourceRow:
        """The source of one of the cells, its seed applied."""
        return self.rows[cell.source, cell.key.source_hash]

    @property
    def source(self) -> SourceRow:
        """The source with the seed that is shown."""
        return self.row(self.cells[self.shown[0]])


def measured(results: Results, cells: Sequence[RunRecord]) -> Iterator[Measured]:
    """Every source of the cells, in the order of their names; one is held in memory at a time."""
    by_name: defaultdict[str, list[RunRecord]] = defaultdict(list)
    for cell in cells:
        by_name[cell.source].append(cell)
    rows = results.sources()
    for _, members in sorted(by_name.items()):
        tracks = {place: trace for place, cell in enumerate(members) if (trace := results.trace(cell.key)) is not None}
        yield Measured(tuple(members), tracks, rows)


@dataclass(frozen=True, eq=False)
class SourceFigures:
    """One source.

    rows         the ranked table
    attributes   by label: figures of the frames of each attribute
    survival     by label: the share of runs still held against frames after the start; no entry where
                 no run has truth
    """

    name: str
    rows: tuple[SummaryRow, ...]
    attributes: Mapping[str, tuple[AttributeRow, ...]]
    survival: Mapping[str, Survival]


@dataclass(frozen=True, eq=False)
class SeverityFigures:
    """A scenario run at several severities: where each tracker breaks, by label."""

    family: str
    breaking: Mapping[str, Breaking]


@dataclass(frozen=True)
class Failure:
    """A failed cell: who, on what, and its error text; `more` other cells failed in the same words."""

    label: str
    source: str
    seed: int
    error: str
    more: int

    @property
    def brief(self) -> str:
        """The last line: what was raised."""
        return self.error.strip().splitlines()[-1] if self.error.strip() else "no error text"


@dataclass(frozen=True, eq=False)
class Figures:
    """All of a results file; `overall` over all sources."""

    results: str
    overall: tuple[SummaryRow, ...]
    sources: tuple[SourceFigures, ...]
    severities: tuple[SeverityFigures, ...]
    failures: tuple[Failure, ...]


def source_figures(measured: Measured) -> SourceFigures:
    """The figures of one source."""
    traces = measured.traces
    told = {label: [trace for trace in each if trace.scored.any()] for label, each in traces.items()}
    return SourceFigures(
        name=measured.name,
        rows=tuple(summary(measured.cells)),
        attributes={label: tuple(by_attribute(each)) for label, each in told.items() if each},
        survival={label: survival(each) for label, each in told.items() if each},
    )


def survival(traces: Sequence[Trace]) -> Survival:
    """The share of tracks not yet lost against frames after the start."""
    lost = [trace.lost_position for trace in traces]
    ended = [len(trace.indices) - 1 if at is None else at for trace, at in zip(traces, lost, strict=True)]
    return kaplan_meier(ended, [at is not None for at in lost])


def severity_figures(cells: Sequence[RunRecord]) -> tuple[SeverityFigures, ...]:
    """Of every scenario that was run at two severities or more; a failed run counts as lost."""
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
    """The failed cells, one for each tracker, source and error."""
    alike: defaultdict[tuple[str, str, str], list[RunRecord]] = defaultdict(list)
    for cell in cells:
        if cell.status == "failed":
            last_line = (cell.failure or "").strip().rpartition("\n")[2]
            alike[cell.label, cell.source, last_line].append(cell)
    return tuple(
        Failure(label, source, members[0].key.tracker_seed, members[0].failure or "", len(members) - 1)
        for (label, source, _), members in alike.items()
    )
