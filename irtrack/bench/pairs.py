"""Runs of two trackers on the same frames, and runs that only repeat another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from irtrack.bench.cell import Cell
from irtrack.metrics import FIGURES, Difference, paired_difference

Pair = tuple[Cell, Cell]


def distinct(cells: Iterable[Cell]) -> list[Cell]:
    """The cells without those that repeat another: same tracker, same frames, and the very same outcome.

    A tracker that draws nothing at random does the same with every tracker seed: that is one run.
    """
    return list({_doing(cell): cell for cell in reversed(list(cells))}.values())[::-1]


def pairs(a: Iterable[Cell], b: Iterable[Cell]) -> list[Pair]:
    """Each of `b` with that of `a` on the same frames with the same tracker seed; repeats count once."""
    firsts = {_frames(cell): cell for cell in a}
    both = [(first, second) for second in b if (first := firsts.get(_frames(second))) is not None]
    return list({(_doing(first), _doing(second)): (first, second) for first, second in both}.values())


def difference(both: Sequence[Pair], figure: str) -> Difference | None:
    """Second less first of a figure over the pairs, its interval by whole scenes; None where no pair has it."""
    firsts, seconds = ([value(pair[side], figure) for pair in both] for side in (0, 1))
    scenes = [f"{a.source}/{a.key.source_hash}" for a, _ in both]
    return paired_difference(seconds, firsts, scenes, most=FIGURES[figure].most)


def value(cell: Cell, figure: str) -> float:
    """A figure of a run, nan where it has none; a failed run counts as lost and has no other figure."""
    if cell.score is None:
        return 1.0 if figure == "lost" else math.nan
    known = cell.score.figure(figure)
    return math.nan if known is None else float(known)


def _frames(cell: Cell) -> tuple[object, ...]:
    """What two runs must share to have seen the same."""
    key = cell.key
    return cell.source, key.source_hash, key.target, key.start, key.input, key.tracker_seed


def _doing(cell: Cell) -> tuple[object, ...]:
    """What a run and its repeats have in common."""
    key = cell.key
    where = (cell.source, key.source_hash, key.target, key.start, key.input)
    told_by = key.tracker_seed if cell.outcome is None else cell.outcome
    return cell.label, key.config, key.code_hash, *where, cell.status, told_by
