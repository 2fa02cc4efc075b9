"""The gallery: each tracker's first failure on each source, as a picture of the frame in which it was lost."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim import IrsimError
from irsim.types import Source
from irtrack.bench import Cell, Results, SourceRow
from irtrack.report.filmstrip import Follower, Still, still
from irtrack.report.opening import opened
from irtrack.report.palette import LineStyle
from irtrack.report.repeat import run_command

MOST = 48
"""So many failures are shown, every tracker's in turn."""

AFTER = 3
"""The picture is of so many frames after that to which the loss is dated: by then the two have parted."""


@dataclass(frozen=True)
class Loss:
    """A run that was lost: of whom, on what, when, and how to repeat it."""

    label: str
    source: str
    seed: int
    lost_at: int
    command: str
    still: Still


def gallery(results: Results, cells: Sequence[Cell], styles: Mapping[str, LineStyle]) -> tuple[tuple[Loss, ...], int]:
    """The first failures, and how many there are in all; a source that cannot be opened any more shows none."""
    first = _first_losses(cells)
    rows = results.sources()
    sources: dict[tuple[str, str], Source | None] = {}
    found = []
    for cell in _in_turn(first)[:MOST]:
        place = cell.source, cell.key.source_hash
        if place not in sources:
            sources[place] = _opened(rows[place])
        source = sources[place]
        if source is not None and (loss := _loss(results, cell, rows[place], source, styles)) is not None:
            found.append(loss)
    return tuple(sorted(found, key=lambda loss: (loss.source, loss.label))), len(first)


def _first_losses(cells: Sequence[Cell]) -> list[Cell]:
    """Of each tracker and family of sources the lost run of the least severity and seed."""
    firsts: dict[tuple[str, str], Cell] = {}
    for cell in sorted(cells, key=lambda cell: (cell.family, cell.label, cell.severity or 0, cell.key.tracker_seed)):
        if cell.score is not None and cell.score.lost:
            firsts.setdefault((cell.family, cell.label), cell)
    return list(firsts.values())


def _in_turn(cells: Sequence[Cell]) -> list[Cell]:
    """Every tracker's first, then every tracker's second, and so on."""
    nth: defaultdict[str, int] = defaultdict(int)
    order = []
    for cell in cells:
        order.append((nth[cell.label], cell.label))
        nth[cell.label] += 1
    return [cells[place] for place in sorted(range(len(cells)), key=order.__getitem__)]


def _opened(row: SourceRow) -> Source | None:
    try:
        source = opened(row)
    except IrsimError:
        return None
    return source if source.hash == row.hash else None


def _loss(results: Results, cell: Cell, row: SourceRow, source: Source, styles: Mapping[str, LineStyle]) -> Loss | None:
    trace = results.trace(cell.key)
    if trace is None or cell.score is None or cell.score.lost_at is None:
        return None
    at = int(np.searchsorted(trace.indices, cell.score.lost_at))
    index = int(trace.indices[min(at + AFTER, len(trace.indices) - 1)])
    follower = Follower(cell.label, styles[cell.label], trace, cell.score.lost_at)
    try:
        picture = still(source.frame(index, "display").image, index, "", [follower], both=True)
    except IrsimError:
        return None
    return Loss(cell.label, cell.source, cell.key.tracker_seed, cell.score.lost_at, run_command(cell, row), picture)
