"""Runs of two trackers on the same frames, and runs that only repeat another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from irtrack.bench.records import RunRecord
from irtrack.metrics import FIGURES, LEAST_SCENES, CentreFigures, Difference, Score, paired_difference, wilson

Pair = tuple[RunRecord, RunRecord]


def distinct(cells: Iterable[RunRecord]) -> list[RunRecord]:
    """The cells without those that repeat another: same tracker, same frames, and the very same outcome.

    A tracker that draws nothing at random does the same with every tracker seed: that is one run.
    """
    return list({_doing(cell): cell for cell in reversed(list(cells))}.values())[::-1]


def pairs(a: Iterable[RunRecord], b: Iterable[RunRecord]) -> list[Pair]:
    """Each of `b` with that of `a` on the same frames with the same tracker seed; repeats count once."""
    firsts = {_frames(cell): cell for cell in a}
    both = [(first, second) for second in b if (first := firsts.get(_frames(second))) is not None]
    return list({(_doing(first), _doing(second)): (first, second) for first, second in both}.values())


def difference(both: Sequence[Pair], figure: str) -> Difference | None:
    """Second less first of a figure over the pairs, its interval by whole scenes; None where no pair has it."""
    firsts, seconds = ([value(pair[side], figure) for pair in both] for side in (0, 1))
    scenes = [f"{a.source}/{a.key.source_hash}" for a, _ in both]
    return paired_difference(seconds, firsts, scenes, most=FIGURES[figure].most)


def value(cell: RunRecord, figure: str) -> float:
    """A figure of a run, nan where it has none; a failed run counts as lost and has no other figure."""
    if cell.score is None:
        return 1.0 if figure == "lost" else math.nan
    known = cell.score.figure(figure)
    return math.nan if known is None else float(known)


def _frames(cell: RunRecord) -> tuple[object, ...]:
    """What two runs must share to have seen the same."""
    key = cell.key
    return cell.source, key.source_hash, key.target, key.start, key.input, key.tracker_seed


def _doing(cell: RunRecord) -> tuple[object, ...]:
    """What a run and its repeats have in common."""
    key = cell.key
    where = (cell.source, key.source_hash, key.target, key.start, key.input)
    told_by = key.tracker_seed if cell.outcome is None else cell.outcome
    return cell.label, key.config, key.code_hash, *where, cell.status, told_by


ALL_SOURCES = "all sources"

Standing = Literal["told", "tie", "too few"]

MARKS: dict[Standing, str] = {"told": "", "tie": "=", "too few": "?"}
"""What stands behind a rank."""

RULES: dict[Standing, str] = {
    "tie": "a tie: by none of lost, off_share and error_held do the paired runs tell it from the row above (95 %)",
    "too few": f"too few runs on the frames of the row above to tell the two apart: {LEAST_SCENES} are needed",
}
"""What the marks say, for those who read tables."""


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """One tracker on one source (or on all), over its runs. A figure is None where nothing tells it.

    rank              1 is best: fewest runs lost or failed, then fewest frames off, then smallest
                      error before loss, then fastest; by the runs of those scenes that every
                      tracker of the source has, so that all are judged on the same ones
    standing          whether it is told from the row above by more than luck: see `RULES`
    compared          how many runs the rank goes by (all, where there is no scene that all have)
    runs, failed      cells that do not repeat another, and those of them in which the tracker raised
    repeats           cells left out for they repeat another to the bit: see `irtrack.bench.pairs.distinct`
    scored            runs that did not fail and have truth;  lost  those of them that were lost
    lost_share        lost/scored, with its Wilson 95 % interval lost_low .. lost_high
    held              centre errors of the frames before the loss, those of all runs taken together
    off_share, precision_*, success_auc, ms_median
                      means over runs of the figures of `irtrack.metrics.Score`
    """

    source: str
    label: str
    rank: int
    standing: Standing
    compared: int
    runs: int
    repeats: int
    failed: int
    scored: int
    lost: int
    lost_share: float | None
    lost_low: float | None
    lost_high: float | None
    held: CentreFigures
    off_share: float | None
    precision_5: float | None
    precision_20: float | None
    precision_norm: float | None
    success_auc: float | None
    ms_median: float | None

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON or a table."""
        flat = asdict(self)
        held: dict[str, Any] = flat.pop("held")
        return flat | held


def summary(cells: Iterable[RunRecord], overall: bool = False) -> list[SummaryRow]:
    """Rows per source and label, each source's ranked from 1; with `overall`, per label over all sources."""
    groups: dict[str, dict[str, list[RunRecord]]] = {}
    for cell in cells:
        source = ALL_SOURCES if overall else cell.source
        groups.setdefault(source, {}).setdefault(cell.label, []).append(cell)
    rows = []
    for source, labels in groups.items():
        common = set.intersection(*({_scene(cell) for cell in members} for members in labels.values()))
        fair = {label: [cell for cell in each if _scene(cell) in common] or each for label, each in labels.items()}
        once = {label: distinct(each) for label, each in fair.items()}
        ranked = sorted(labels, key=lambda label: (_order(once[label]), label))
        for rank, label in enumerate(ranked, start=1):
            standing: Standing = "told" if rank == 1 else _standing(fair[ranked[rank - 2]], fair[label])
            rows.append(_row(source, label, rank, standing, labels[label], len(once[label])))
    return rows


def _scene(cell: RunRecord) -> tuple[str, str]:
    """What two trackers must share to be compared: the source and its scene."""
    return cell.source, cell.key.source_hash


def _standing(above: list[RunRecord], below: list[RunRecord]) -> Standing:
    """Does the first figure that tells the two apart speak for the one above?"""
    both = pairs(above, below)
    found = [each for name in ("lost", "off_share", "error_held") if (each := difference(both, name)) is not None]
    if all(each.is_open for each in found):
        return "too few"
    telling = [each for each in found if not each.is_tie]
    return "told" if telling and telling[0].mean > 0 else "tie"


def _row(source: str, label: str, rank: int, standing: Standing, every: list[RunRecord], compared: int) -> SummaryRow:
    cells = distinct(every)
    scores = _scores(cells)
    told = [score for score in scores if score.lost is not None]
    lost = sum(score.lost is True for score in told)
    low, high = wilson(lost, len(told)) if told else (None, None)
    return SummaryRow(
        source=source,
        label=label,
        rank=rank,
        standing=standing,
        compared=compared,
        runs=len(cells),
        repeats=len(every) - len(cells),
        failed=sum(cell.status == "failed" for cell in cells),
        scored=len(told),
        lost=lost,
        lost_share=lost / len(told) if told else None,
        lost_low=low,
        lost_high=high,
        held=_together([(score.held_frames, score.held) for score in scores]),
        off_share=_mean([score.off_share for score in scores]),
        precision_5=_mean([score.precision_5 for score in scores]),
        precision_20=_mean([score.precision_20 for score in scores]),
        precision_norm=_mean([score.precision_norm for score in scores]),
        success_auc=_mean([score.success_auc for score in scores]),
        ms_median=_mean([score.ms_median for score in scores]),
    )


def _order(cells: list[RunRecord]) -> tuple[float, float, float, float]:
    scores = _scores(cells)
    broken = sum(cell.lost_or_failed for cell in cells)
    figures = (
        _mean([score.off_share for score in scores]),
        _pooled([(score.held_frames, score.held.error) for score in scores]),
        _mean([score.ms_median for score in scores]),
    )
    off, error, ms = (math.inf if figure is None else figure for figure in figures)
    return broken / len(cells), off, error, ms


def _scores(cells: list[RunRecord]) -> list[Score]:
    return [cell.score for cell in cells if cell.score is not None]


def _mean(figures: list[float | None]) -> float | None:
    known = [figure for figure in figures if figure is not None]
    return sum(known) / len(known) if known else None


def _together(parts: list[tuple[int, CentreFigures]]) -> CentreFigures:
    """The figures over all frames, from (frames, figures) of each run."""
    abs_x, sd_x = _pooled_spread([(count, each.abs_x, each.sd_x) for count, each in parts])
    abs_y, sd_y = _pooled_spread([(count, each.abs_y, each.sd_y) for count, each in parts])
    return CentreFigures(
        error=_pooled([(count, each.error) for count, each in parts]),
        abs_x=abs_x,
        abs_y=abs_y,
        sd_x=sd_x,
        sd_y=sd_y,
        rmse=_pooled_rms([(count, each.rmse) for count, each in parts]),
        rmse_x=_pooled_rms([(count, each.rmse_x) for count, each in parts]),
        rmse_y=_pooled_rms([(count, each.rmse_y) for count, each in parts]),
    )


def _pooled(parts: list[tuple[int, float | None]]) -> float | None:
    """The mean over all frames, from (frames, mean) of each run."""
    known = [(count, mean) for count, mean in parts if count and mean is not None]
    total = sum(count for count, _ in known)
    return sum(count * mean for count, mean in known) / total if total else None


def _pooled_rms(parts: list[tuple[int, float | None]]) -> float | None:
    """The root mean square over all frames, from (frames, root mean square) of each run."""
    square = _pooled([(count, None if value is None else value * value) for count, value in parts])
    return None if square is None else math.sqrt(square)


def _pooled_spread(parts: list[tuple[int, float | None, float | None]]) -> tuple[float | None, float | None]:
    """Mean and standard deviation over all frames, from (frames, mean, sd) of each run.

    E[x^2] = sd^2 + mean^2 holds in each run and in the whole.
    """
    mean = _pooled([(count, value) for count, value, _ in parts])
    square = _pooled([(n, None if m is None or sd is None else sd * sd + m * m) for n, m, sd in parts])
    if mean is None or square is None:
        return None, None
    return mean, math.sqrt(max(square - mean * mean, 0.0))
