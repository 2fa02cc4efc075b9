"""Metrics of a run, and the rules that test a claim with each seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from irtrack.metrics import Trace
from irtrack.metrics.lost import OFF_PX, off_beyond
from irtrack.papers.experiment import Figure, PairedRule, Rule, Run

BACK_WITHIN = 5
"""Number of frames within which a tracker must be on its target again."""


def _score(words: str, name: str) -> Figure:
    """Return the metric of `irtrack.metrics.FIGURES` with this name."""
    return Figure(words, lambda run: run.score.figure(name))


def _variance(words: str, name: str) -> Figure:
    return Figure(words, lambda run: None if (sd := run.score.figure(name)) is None else sd**2)


def _tracking(words: str, hit: Callable[[np.ndarray], np.ndarray], missing: bool = False) -> Figure:
    """Return the share of scored frames with status `tracking` and a centre error that passes `hit`; `missing`: 1 -
    share."""

    def of(run: Run) -> float | None:
        trace = run.trace
        if not trace.scored.any():
            return None
        share = float(np.mean((hit(trace.errors) & (trace.statuses == "tracking"))[trace.scored]))
        return 1 - share if missing else share

    return Figure(words, of)


def _until_back(run: Run) -> float | None:
    """Return the number of frames from the end of the first occlusion to a frame on the target; inf: never."""
    if not run.trace.returns:
        return None
    after = run.trace.returns[0].after
    return float("inf") if after is None else float(after)


def _bounded(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Return min(error, threshold) of each scored frame and the threshold beyond which it is off target, px."""
    scored = trace.scored
    limits = off_beyond(np.hypot(trace.truth_sizes[scored, 0], trace.truth_sizes[scored, 1]), trace.accuracy[scored])
    return np.minimum(trace.errors[scored], limits), limits


def _bounded_error(run: Run) -> float | None:
    errors, _ = _bounded(run.trace)
    return float(np.mean(errors)) if len(errors) else None


def _bounded_share(run: Run) -> float | None:
    errors, limits = _bounded(run.trace)
    return float(np.mean(errors / limits)) if len(errors) else None


error_held = _score("mean error before loss", "error_held")
error_all = _score("mean error", "error")
abs_x = _score("mean |error| in X", "abs_x")
abs_y = _score("mean |error| in Y", "abs_y")
variance_x = _variance("variance in X", "sd_x")
variance_y = _variance("variance in Y", "sd_y")
bounded_error = Figure("bounded error", _bounded_error)
"""Mean of min(error, threshold beyond which a frame is off target) over all scored frames, px: defined for lost runs
too, and two trackers hardly tie."""
bounded_share = Figure("bounded error as a share", _bounded_share)
"""The same with each frame's error divided by its threshold, 0 .. 1."""
lost = _score("lost", "lost")
off_share = _score("share of frames off target", "off_share")
cpu = _score("CPU time", "cpu_ms_median")
"""Median CPU time of a step, ms. Other programs on the machine do not lengthen it."""
wall = _score("wall time", "ms_median")
"""Median wall time of a step, ms, for external trackers, which take no CPU time of this process."""
detected = _tracking("detections", lambda errors: errors <= OFF_PX)
missed = _tracking("missed detections", lambda errors: errors <= OFF_PX, missing=True)
false_alarms = _tracking("false alarms", lambda errors: errors > OFF_PX)


def error_over(first: int, last: int) -> Figure:
    """Return the mean centre error of frames first .. last, px."""

    def of(run: Run) -> float | None:
        errors = run.trace.errors[(run.trace.indices >= first) & (run.trace.indices <= last) & run.trace.scored]
        return float(np.mean(errors)) if len(errors) else None

    return Figure(f"mean error in frames {first} to {last}", of)


def score_between(first: int, last: int) -> Figure:
    """Return the median of the tracker's own score in frames first .. last."""

    def of(run: Run) -> float | None:
        scores = run.trace.scores[(run.trace.indices >= first) & (run.trace.indices <= last)]
        return float(np.median(scores)) if len(scores) and np.isfinite(scores).all() else None

    return Figure(f"median coefficient in frames {first} to {last}", of)


def unless_lost(figure: Figure) -> Figure:
    """Return the same metric, but None for runs with track loss."""
    return Figure(figure.words, lambda run: None if run.score.lost else figure.of(run))


def _rule(words: str, figure: Figure, labels: tuple[str, ...], test: Callable[..., bool | None]) -> Rule:
    """Return the rule that applies `test` to the metric of each tracker; a run without the metric does not decide."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        values = [value for label in labels if (value := figure.of(runs[label])) is not None]
        return test(*values) if len(values) == len(labels) else None

    return Rule(words, labels, of)


def holds(label: str) -> Rule:
    """Return the rule that the tracker does not lose the target."""
    return Rule(f"{label} is not lost", (label,), lambda runs: not runs[label].score.lost)


def loses(label: str) -> Rule:
    """Return the rule that the tracker loses the target."""
    return _rule(f"{label} is lost", lost, (label,), bool)


def loses_about(label: str, frame: int, within: int) -> Rule:
    """Return the rule that the tracker loses the target at most `within` frames before or after frame `frame`."""
    lost_at = Figure("", lambda run: float("inf") if run.score.lost is False else run.score.lost_at)
    words = f"{label} is lost within {within} frames of frame {frame}"
    return _rule(words, lost_at, (label,), lambda at: abs(at - frame) <= within)


def nearer(label: str, other: str) -> PairedRule:
    """Return the rule that the mean bounded error of one tracker is below that of another."""
    return PairedRule(bounded_error, label, other)


def no_worse(label: str, other: str) -> PairedRule:
    """Return the rule that the mean bounded error of one tracker is at most a margin above that of another."""
    return PairedRule(bounded_error, label, other, "no_worse")


def as_near(label: str, other: str) -> PairedRule:
    """Return the rule that the mean bounded errors of two trackers are equal within a margin."""
    return PairedRule(bounded_error, label, other, "equal")


def less(figure: Figure, label: str, other: str) -> Rule:
    """Return the rule that a metric of one tracker is less than that of another; equal values do not decide."""
    words = f"{figure.words} of {label} below that of {other}"
    return _rule(words, figure, (label, other), lambda own, its: None if own == its else own < its)


def at_most(figure: Figure, label: str, limit: float, unit: str = "") -> Rule:
    """Return the rule that a metric is at most `limit`."""
    words = f"{figure.words} of {label} at or below {limit:g}{unit}"
    return _rule(words, figure, (label,), lambda own: own <= limit)


def times(figure: Figure, label: str, factor: float, other: str) -> Rule:
    """Return the rule that a metric of one tracker is at least `factor` times that of another."""
    words = f"{figure.words} of {label} at least {factor:g} times that of {other}"
    return _rule(words, figure, (label, other), lambda own, its: own >= factor * its)


def nearly(figure: Figure, label: str, other: str, within: float, relative: bool = False) -> Rule:
    """Return the rule that a metric of two trackers differs by at most `within`, or `within` times the other's."""
    amount = f"{100 * within:g} %" if relative else f"{within:g}"
    words = f"{figure.words} of {label} within {amount} of that of {other}"

    def test(own: float, its: float) -> bool:
        return abs(own - its) <= within * (its if relative else 1)

    return _rule(words, figure, (label, other), test)


def on_target(label: str, first: int, last: int) -> Rule:
    """Return the rule that the mean centre error over frames first .. last is at most OFF_PX."""
    return at_most(error_over(first, last), label, OFF_PX, " px")


def back_in_time(label: str) -> Rule:
    """Return the rule that the tracker is on the target within BACK_WITHIN frames of its first return."""
    words = f"{label} is on the target within {BACK_WITHIN} frames of its return"
    return _rule(words, Figure("", _until_back), (label,), lambda back: back <= BACK_WITHIN)


def mostly_nearer(label: str, other: str) -> Rule:
    """Return the rule that one tracker is nearer to the target than another in more than half of the frames."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = runs[label].trace, runs[other].trace
        return bool(np.mean((own.errors < its.errors)[own.scored]) > 0.5) if own.scored.any() else None

    return Rule(f"{label} nearer than {other} in more than half of the frames", (label, other), of)
