"""Output of the commands: tables, JSON and scores on standard output; counts for progress lines."""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from irsim.errors import counted

if TYPE_CHECKING:
    from irtrack.bench import RunRecord, SummaryRow
    from irtrack.bench.bounds import BoundRow
    from irtrack.bench.task_summary import TaskBreaking, TaskRow
    from irtrack.falsify.rules import Explanation
    from irtrack.metrics import Score
    from irtrack.types import Track

NOTHING = "-"

_STDOUT, _STDERR = 1, 2


def keep_output() -> None:
    """Redirect output of native code of trackers (printf, std::cout) from standard output to standard error.

    Worker processes inherit this. `irtrack.replay.replay` redirects the output of Python code.
    """
    try:
        if sys.stdout.fileno() != _STDOUT:
            return
        sys.stdout.flush()
        own = os.dup(_STDOUT)
        os.dup2(_STDERR, _STDOUT)
    except (AttributeError, OSError, ValueError):  # standard output or standard error is closed
        return
    old = sys.stdout
    sys.stdout = open(own, "w", encoding=old.encoding, errors=old.errors, buffering=1 if old.isatty() else -1)  # noqa: SIM115 - open as long as the program runs


def warn_unused(sources: Iterable[str], changes: Sequence[str]) -> None:
    """Warn on standard error, once, of each override without an effect on the scenarios."""
    from irsim import unheeded

    if not changes:
        return
    for warning in dict.fromkeys(line for source in sources for line in unheeded(source, changes)):
        print(warning, file=sys.stderr)


def print_json(value: Any) -> None:
    """Print one JSON document."""
    json.dump(value, sys.stdout, indent=1, allow_nan=False)
    sys.stdout.write("\n")


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> None:
    """Print a table; the first `left` columns are flush left, the others right."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = [
            cell.ljust(width) if column < left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        print("  ".join(cells).rstrip())


def print_run(track: Track, score: Score, has_truth: bool) -> None:
    """Print tracker, source, target and scores, or the reason why there are none; `has_truth`: the source has truth."""
    indices = track.indices
    followed = track.target or "a given box"
    print(
        f"{track.tracker} on {track.source}: {followed}, "
        f"frames {indices[0]} to {indices[-1]}, seed {track.tracker_seed}"
    )
    if score.lost is None:
        print(f"no scores: {_why_unscored(track, has_truth)}")
        counts = [(status, track.statuses.count(status)) for status in ("tracking", "occluded", "lost")]
        own = ", ".join(f"{status} in {counted(count, 'frame')}" for status, count in counts if count)
        print(f"own status: {own}")
        print(f"time         {number(score.ms_median, '.3g')} ms a frame (median)")
        return
    after = len(track.indices) - 1
    absent, hidden = after - score.frames, score.frames - score.counted_frames
    print(f"scored       {score.frames} of {counted(after, 'frame')}{f'; absent in {absent}' if absent else ''}")
    judged = f" (judged on {score.counted_frames} of these frames; more than half hidden in the other {hidden})"
    print(f"lost         {f'at frame {score.lost_at}' if score.lost else 'no'}{judged if hidden else ''}")
    print(f"|error| x    {number(score.all.abs_x)} ± {number(score.all.sd_x)} px")
    print(f"|error| y    {number(score.all.abs_y)} ± {number(score.all.sd_y)} px")
    print(f"rmse         {number(score.all.rmse)} px")
    print(f"within 5 px  {number(score.precision_5, '.3f')}    20 px  {number(score.precision_20, '.3f')}")
    print(f"norm. prec.  {number(score.precision_norm, '.3f')}")
    print(f"success AUC  {number(score.success_auc, '.3f')}")
    print(f"time         {number(score.ms_median, '.3g')} ms a frame (median)")


def _why_unscored(track: Track, has_truth: bool) -> str:
    if not has_truth:
        return "the source has no truth"
    if track.target is None:
        return "a box was given without a target; --target ID names it for the scores"
    if len(track.indices) == 1:
        return "there is no frame after the start"
    return f"'{track.target}' is in none of the frames after the start"


def print_summary(rows: Sequence[SummaryRow]) -> None:
    """Print the ranked table of each source; centre errors are those before the loss."""
    from irtrack.bench.summary import MARKS, RULES, marked

    head = ("source", "tracker", "runs", "lost", "95 %", "|x| held", "|y| held", "<= 5 px", "<= 20 px", "AUC", "ms")
    print_table(
        head,
        [
            (
                row.source,
                f"{row.rank}{MARKS[row.standing] or '.'} {marked(row)}" if row.rank else row.label,
                _runs(row),
                number(row.lost_share, ".0%"),
                NOTHING if row.lost_low is None else f"{row.lost_low:.0%}..{row.lost_high:.0%}",
                number(row.held.abs_x),
                number(row.held.abs_y),
                number(row.precision_5, ".3f"),
                number(row.precision_20, ".3f"),
                number(row.success_auc, ".3f"),
                number(row.ms_median, ".3g"),
            )
            for row in rows
        ],
        left=2,
    )
    for standing, rule in RULES.items():
        if any(row.standing == standing for row in rows):
            print(f"{MARKS[standing]} {rule}")
    if any(row.lost_share for row in rows):
        print("held: mean |error|, px, before the loss: over few frames where the target is lost at once")
    _explain_pose(rows)


def print_bounds(rows: Sequence[BoundRow]) -> None:
    """Print the errors before the loss as multiples of the bound, where there are bounds."""
    from irtrack.metrics.bound import LEAST_D, LEAST_SD_PX

    if not rows:
        return
    head = ("source", "tracker", "runs", "lost", "frames", "rms / bound", "95 %", "bias x, y px", "spread x, y px")
    print_table(head, [_bound_texts(row) for row in rows], left=2)
    print(f"rms / bound: frames before the loss with detectability d >= {LEAST_D:g} and bound >= {LEAST_SD_PX:g} px")


def _bound_texts(row: BoundRow) -> tuple[str, ...]:
    each = row.figures
    interval = NOTHING if each.low is None else f"{number(each.low)}..{number(each.high)}"
    bias, spread = ((each.bias_x, each.bias_y), (each.spread_x, each.spread_y))
    pairs = (f"{number(x, '.3f')}, {number(y, '.3f')}" if each.frames else NOTHING for x, y in (bias, spread))
    lost = number(each.lost_share, ".0%")
    return row.source, row.label, str(each.runs), lost, str(each.frames), number(each.ratio), interval, *pairs


def print_tasks(rows: Sequence[TaskRow]) -> None:
    """Print a table of trackers of many targets and one of detectors: means over the runs, the first figure with its
    interval."""
    from irtrack.bench.summary import MARKS, marked
    from irtrack.bench.task_summary import SHOWN
    from irtrack.metrics.ceiling import NEEDS_TRUTH
    from irtrack.metrics.tasks import ALL_FIGURES, RANKED_BY

    for task, shown in SHOWN.items():
        own = [row for row in rows if row.task == task]
        if not own:
            continue
        print_table(
            ("source", "tracker" if task == "many" else "detector", "runs", shown[0], "95 %", *shown[1:]),
            [
                (
                    row.source,
                    f"{row.rank}{MARKS[row.standing] or '.'} {marked(row)}" if row.rank else row.label,
                    f"{row.runs} ({row.failed} failed)" if row.failed else str(row.runs),
                    *_mean_and_interval(row, shown[0]),
                    *(number(None if (mean := row.means[name]) is None else mean[0], ".3g") for name in shown[1:]),
                )
                for row in own
            ],
            left=2,
        )
        ranked = ", ".join(RANKED_BY[task])
        for mark, meaning in (("=", f"a tie with the row above by {ranked}"), ("?", "too few runs to tell")):
            if any(MARKS[row.standing] == mark for row in own):
                print(f"{mark} {meaning}")
        _explain_pose(own)
        if any(row.rank == 0 for row in own):
            print(NEEDS_TRUTH)
        units = ", ".join(f"{name} {ALL_FIGURES[name].unit}" for name in shown if ALL_FIGURES[name].unit)
        matching = "; tracks match targets by the distance of centres" if task == "many" else ""
        print(f"units: {units}{matching}")


def print_breaking(families: Sequence[TaskBreaking]) -> None:
    """Print the severity at which half of the runs of each tracker of many or detector break, a line for each
    scenario."""
    from irtrack.bench.task_summary import BREAKS

    for each in families:
        points = ", ".join(f"{label} {each.in_words(label)}" for label in each.points)
        print(f"{each.family}: {each.axis} at which {BREAKS[each.task][1]} in half of the runs: {points}")


def _explain_pose(rows: Sequence[SummaryRow] | Sequence[TaskRow]) -> None:
    """Print the meaning of the mark of trackers that get the camera's pose, where a row has it."""
    from irtrack.bench.summary import POSE_MARK, POSE_RULE

    if any("pose" in row.needs for row in rows):
        print(f"{POSE_MARK} {POSE_RULE}")


def _mean_and_interval(row: TaskRow, name: str) -> tuple[str, str]:
    found = row.means[name]
    if found is None:
        return NOTHING, NOTHING
    mean, low, high = found
    return f"{mean:.3g}", f"{low:.3g}..{high:.3g}" if low > -float("inf") else NOTHING


def _runs(row: SummaryRow) -> str:
    notes = [f"{row.failed} failed"] if row.failed else []
    notes += [f"{row.compared} ranked"] if row.compared != row.runs else []
    notes += [f"+{row.repeats} identical"] if row.repeats else []
    return str(row.runs) + (f" ({', '.join(notes)})" if notes else "")


def number(value: float | None, form: str = ".2f") -> str:
    """Return a formatted number, or a dash for None."""
    return NOTHING if value is None else format(value, form)


def print_rules(expected: Sequence[Explanation]) -> None:
    """Print the outcome of each rule that a scenario states."""
    for rule in expected:
        print(f"{'broken' if rule.margin < 0 else 'held':12} {rule.asked}: {rule.reached}")


class Tally:
    """Counts of finished, lost and failed runs for the progress line."""

    def __init__(self) -> None:
        self.done = 0
        self._runs: Counter[str] = Counter()
        self._bad: Counter[str] = Counter()

    def see(self, cell: RunRecord) -> None:
        """Count a finished run."""
        self._runs[cell.label] += 1
        self._bad[cell.label] += cell.lost_or_failed

    def worst(self) -> str:
        """Return 'worst: template, 3 of 4 lost or failed'; '' without a loss."""
        label = max(self._runs, key=lambda each: self._bad[each] / self._runs[each], default=None)
        if label is None or not self._bad[label]:
            return ""
        return f"worst: {label}, {self._bad[label]} of {self._runs[label]} lost or failed"
