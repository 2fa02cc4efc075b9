"""Bounds of the scenes in a results file, and errors of its runs against them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from irsim import FrameBounds, IrsimError, Recording, loads, open_recording
from irsim.types import TargetBounds
from irtrack.bench.records import RunRecord, SourceRow
from irtrack.bench.results import Results
from irtrack.bench.summary import distinct
from irtrack.metrics.bound import BoundFigures, TargetBound, bound_figures


@dataclass(frozen=True, slots=True)
class BoundRow:
    """Errors of a tracker on a source against the bound."""

    source: str
    label: str
    figures: BoundFigures

    def as_dict(self) -> dict[str, Any]:
        return {"source": self.source, "label": self.label, **self.figures.as_dict()}


def compute_bounds(
    results: Results, cells: Sequence[RunRecord], progress: Callable[[int, int], None] | None = None
) -> list[str]:
    """Compute and store the bounds of the runs' scenes and targets that the results file lacks.

    Return a line for each source without bounds, with the reason: a recording without `/truth/bounds` (see `irsim
    render --bounds`), or a scene that has none or cannot be opened. No code named by a scenario is run.

    progress   called with (frames done, frames to do)
    """
    rows = results.sources()
    missing = dict.fromkeys(
        (cell.source, cell.key.source_hash, cell.key.target)
        for cell in cells
        if cell.key.task == "single" and cell.key.target is not None
    )
    wanted = [(rows[name, digest], target) for name, digest, target in missing if target is not None]
    wanted = [(row, target) for row, target in wanted if results.bounds(row.hash, target) is None]
    done, total, notes = 0, sum(row.length for row, _ in wanted), {}
    for row, target in wanted:
        found: list[TargetBounds] = []
        try:
            for part in frame_bounds(row, target):
                found += part
                done += 1
                if progress is not None:
                    progress(done, total)
        except IrsimError as error:
            notes[row.name] = f"{row.name}: no bounds: {error}"
        else:
            results.add_bounds(row.hash, target, TargetBound.of(found, target))
    return list(notes.values())


def frame_bounds(row: SourceRow, target: str) -> Iterator[Sequence[TargetBounds]]:
    """Yield the bounds of a target in each frame of a source. Raises irsim's errors for a source without bounds."""
    if row.kind == "recording":
        recording: Recording = open_recording(row.text)
        if not recording.has_bounds:
            raise IrsimError("the recording holds none; allowed: a recording rendered with bounds")
        yield from recording.bounds()
        return
    bounds = FrameBounds(loads(row.text, row.name, trusted=False), [target])
    for index in range(row.length):
        yield bounds.of(index)


def bound_rows(results: Results, cells: Sequence[RunRecord]) -> list[BoundRow]:
    """Return the errors of each tracker on each source against the bounds in the results file; [] without bounds."""
    groups: dict[tuple[str, str], tuple[list[Any], list[TargetBound]]] = {}
    for cell in distinct(cells):
        if cell.key.task != "single" or cell.key.target is None or cell.status == "failed":
            continue
        bound = results.bounds(cell.key.source_hash, cell.key.target)
        trace = None if bound is None else results.trace(cell.key)
        if bound is not None and trace is not None:
            traces, bounds = groups.setdefault((cell.source, cell.label), ([], []))
            traces.append(trace)
            bounds.append(bound)
    return [BoundRow(source, label, bound_figures(*found)) for (source, label), found in groups.items()]
