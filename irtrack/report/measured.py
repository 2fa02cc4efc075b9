"""What the results file has of each source, read once for all formats."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from irtrack.bench import Cell, Results, SourceRow, distinct
from irtrack.metrics import Trace


@dataclass(frozen=True, eq=False)
class Measured:
    """The cells of one source and the tracks of those that did not fail, by place in `cells`."""

    cells: tuple[Cell, ...]
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

    def row(self, cell: Cell) -> SourceRow:
        """The source of one of the cells, its seed applied."""
        return self.rows[cell.source, cell.key.source_hash]

    @property
    def source(self) -> SourceRow:
        """The source with the seed that is shown."""
        return self.row(self.cells[self.shown[0]])


def measured(results: Results, cells: Sequence[Cell]) -> Iterator[Measured]:
    """Every source of the cells, in the order of their names; one is held in memory at a time."""
    by_name: defaultdict[str, list[Cell]] = defaultdict(list)
    for cell in cells:
        by_name[cell.source].append(cell)
    rows = results.sources()
    for _, members in sorted(by_name.items()):
        tracks = {place: trace for place, cell in enumerate(members) if (trace := results.trace(cell.key)) is not None}
        yield Measured(tuple(members), tracks, rows)
