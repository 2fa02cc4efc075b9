"""Summary of runs by source and tracker: ranks, ties, repeated runs, and paired differences on the same frames."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from irtrack.bench.records import RunRecord
from irtrack.metrics import LEAST_SCENES, CentreFigures, Difference, Score, paired_difference, wilson
from irtrack.metrics.tasks import ALL_FIGURES

if TYPE_CHECKING:
    from irtrack.bench.task_summary import TaskRow

Pair = tuple[RunRecord, RunRecord]


def distinct(cells: Iterable[RunRecord]) -> list[RunRecord]:
    """Return the records without repeated runs, which have the tracker, the frames and the outcome of another run.

    A tracker without randomness has the same outcome with every tracker seed: all these are one run.
    """
    return list({_repeat_key(cell): cell for cell in reversed(list(cells))}.values())[::-1]


def pairs(a: Iterable[RunRecord], b: Iterable[RunRecord]) -> list[Pair]:
    """Pair each record of `b` with the record of `a` on the same frames and tracker seed; repeated runs count once."""
    firsts = {_frames_key(cell): cell for cell in a}
    both = [(first, second) for second in b if (first := firsts.get(_frames_key(second))) is not None]
    return list({(_repeat_key(first), _repeat_key(second)): (first, second) for first, second in both}.values())


def difference(both: Sequence[Pair], figure: str) -> Difference | None:
    """Return the mean of second minus first of a metric, with its interval over scenes; None where no pair has it."""
    firsts, seconds = ([value(pair[side], figure) for pair in both] for side in (0, 1))
    scenes = [f"{a.source}/{a.key.source_hash}" for a, _ in both]
    return paired_difference(seconds, firsts, scenes, most=ALL_FIGURES[figure].most)


def value(cell: RunRecord, figure: str) -> float:
    """Return a figure of a run, nan where it has none; a failed run counts as lost and has no other figure."""
    if cell.status == "failed":
        return 1.0 if figure == "lost" else math.nan
    known = cell.figures.get(figure) if cell.score is None else cell.score.figure(figure)
    return math.nan if known is None else float(known)


def _frames_key(cell: RunRecord) -> tuple[object, ...]:
    """Return the identity of the frames and tracker seed of a run."""
    key = cell.key
    return cell.source, key.task, key.source_hash, key.target, key.start, key.input, key.tracker_seed


def _repeat_key(cell: RunRecord) -> tuple[object, ...]:
    """Return the identity that a run shares with the runs that repeat it."""
    key = cell.key
    where = (cell.source, key.source_hash, key.target, key.start, key.input)
    told_by = key.tracker_seed if cell.outcome is None else cell.outcome
    return cell.label, key.task, key.config, key.code_hash, key.weights, *where, cell.status, told_by


ALL_SOURCES = "all sources"

Standing = Literal["told", "tie", "too few"]

MARKS: dict[Standing, str] = {"told": "", "tie": "=", "too few": "?"}
"""Mark printed after the rank of a row, by how the row differs from the row above."""

RULES: dict[Standing, str] = {
    "tie": "a tie: the paired runs differ from the row above in none of lost, off_share and error_held (95 %)",
    "too few": f"too few runs on the frames of the row above to compare the two: {LEAST_SCENES} are needed",
}
"""Meanings of the marks."""


@dataclass(frozen=True, slots=True)
class SummaryRow:
    """Metrics of one tracker on one source (or on all), over its runs; None where no run has the metric.

    rank              1 is best: fewest runs lost or failed, then fewest frames off target, then smallest
                      error before loss, then fastest; the rank is by the scenes on which every tracker was run
    standing          'told': the row differs from the row above by more than chance; others: see `RULES`
    compared          number of runs that enter the rank (all runs, where the trackers have no scene in common)
    runs, failed      numbers of runs that do not repeat another, and of failed runs among them
    repeats           number of runs left out as bit-identical repetitions, see `distinct`
    scored            number of runs with truth that did not fail;  lost  number of lost runs among them
    lost_share        lost/scored, with its Wilson 95 % interval lost_low .. lost_high
    held              centre errors of the frames before the loss, of all runs together
    off_share, precision_*, success_auc, ms_median
                      means over runs of the metrics of `irtrack.metrics.Score`
    needs             what the tracker gets besides pictures: "pose" or ""
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
    needs: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or a table."""
        flat = asdict(self)
        held: dict[str, Any] = flat.pop("held")
        return flat | held


POSE_MARK = "*"
POSE_RULE = "with the camera's pose of each frame, which other trackers do not get"
"""Mark after the label of a tracker that needs the camera's pose, and its meaning."""


def marked(row: SummaryRow | TaskRow) -> str:
    """Return the label of a row as text, marked where the tracker gets the camera's pose."""
    return row.label + POSE_MARK * ("pose" in row.needs)


MEANS = ("off_share", "precision_5", "precision_20", "precision_norm", "success_auc", "ms_median")
"""Metrics of a row that are means over runs."""

RANKED = ("", "tracker", "runs", "lost", "95 %", "rmse before loss, px", "off", "≤ 5 px", "≤ 20 px", "AUC", "ms")
"""Column heads of the ranked table as text."""

NOTHING = "–"


def ranked_texts(row: SummaryRow) -> tuple[str, ...]:
    """Return the texts of a row under the heads `RANKED`."""
    return (
        f"{row.rank}{MARKS[row.standing]}",
        marked(row),
        f"{row.runs} ({row.failed} failed)" if row.failed else str(row.runs),
        percent(row.lost_share),
        f"{percent(row.lost_low)} to {percent(row.lost_high)}",
        px(row.held.rmse),
        percent(row.off_share),
        share(row.precision_5),
        share(row.precision_20),
        share(row.success_auc),
        ms(row.ms_median),
    )


def px(value: float | None) -> str:
    """Return a length in px with two decimals."""
    return NOTHING if value is None else f"{value:.2f}"


def share(value: float | None) -> str:
    """Return a share or an area 0..1 with three decimals."""
    return NOTHING if value is None else f"{value:.3f}"


def percent(value: float | None) -> str:
    """Return a share in whole percent."""
    return NOTHING if value is None else f"{100 * value:.0f} %"


def ms(value: float | None) -> str:
    """Return a time in ms with three significant digits."""
    return NOTHING if value is None else f"{value:.3g}"


def summary(cells: Iterable[RunRecord], overall: bool = False) -> list[SummaryRow]:
    """Return rows per source and label, ranked from 1 in each source; with `overall`, per label over all sources.

    Runs of other tasks than single are left out (`irtrack.bench.task_summary`).
    """
    groups: dict[str, dict[str, list[RunRecord]]] = {}
    for cell in cells:
        if cell.key.task != "single":
            continue
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
    """Return the identity of the scene, on which trackers are compared."""
    return cell.source, cell.key.source_hash


def _standing(above: list[RunRecord], below: list[RunRecord]) -> Standing:
    """Return the standing of the lower row, by the first metric in which the two rows differ."""
    both = pairs(above, below)
    found = [each for name in ("lost", "off_share", "error_held") if (each := difference(both, name)) is not None]
    if all(each.is_open for each in found):
        return "too few"
    telling = [each for each in found if not each.is_tie]
    return "told" if telling and telling[0].mean > 0 else "tie"


def _row(source: str, label: str, rank: int, standing: Standing, every: list[RunRecord], compared: int) -> SummaryRow:
    cells = distinct(every)
    scores = _scores(cells)
    known = [score for score in scores if score.lost is not None]
    lost = sum(score.lost is True for score in known)
    low, high = wilson(lost, len(known)) if known else (None, None)
    return SummaryRow(
        source=source,
        label=label,
        rank=rank,
        standing=standing,
        compared=compared,
        runs=len(cells),
        repeats=len(every) - len(cells),
        failed=sum(cell.status == "failed" for cell in cells),
        scored=len(known),
        lost=lost,
        lost_share=lost / len(known) if known else None,
        lost_low=low,
        lost_high=high,
        held=_together([(score.held_frames, score.held) for score in scores]),
        **{name: _mean([score.figure(name) for score in scores]) for name in MEANS},
        needs=" ".join(every[0].needs),
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
    """Return the centre-error metrics over all frames, from (number of frames, metrics) of each run."""
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
    """Return the mean over all frames, from (number of frames, mean) of each run."""
    known = [(count, mean) for count, mean in parts if count and mean is not None]
    total = sum(count for count, _ in known)
    return sum(count * mean for count, mean in known) / total if total else None


def _pooled_rms(parts: list[tuple[int, float | None]]) -> float | None:
    """Return the root mean square over all frames, from (number of frames, root mean square) of each run."""
    square = _pooled([(count, None if value is None else value * value) for count, value in parts])
    return None if square is None else math.sqrt(square)


def _pooled_spread(parts: list[tuple[int, float | None, float | None]]) -> tuple[float | None, float | None]:
    """Return mean and standard deviation over all frames, from (number of frames, mean, sd) of each run.

    E[x^2] = sd^2 + mean^2 holds in each run and in the whole.
    """
    mean = _pooled([(count, value) for count, value, _ in parts])
    square = _pooled([(n, None if m is None or sd is None else sd * sd + m * m) for n, m, sd in parts])
    if mean is None or square is None:
        return None, None
    return mean, math.sqrt(max(square - mean * mean, 0.0))
