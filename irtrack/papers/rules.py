"""Figures of a run, and the rules that test a claim in each seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from irtrack.metrics.lost import OFF_PX
from irtrack.papers.experiment import Figure, Rule, Run

BACK_WITHIN = 5
"""Frames within which a tracker must be on its target again."""


def _share(run: Run, hit: np.ndarray) -> float | None:
    scored = run.trace.scored
    return float(np.mean((hit & (run.trace.statuses == "tracking"))[scored])) if scored.any() else None


def _missed(run: Run) -> float | None:
    found = detected(run)
    return None if found is None else 1 - found


def _frames_until_back(run: Run) -> float | None:
    if not run.trace.returns:
        return None
    after = run.trace.returns[0].after
    return float("inf") if after is None else float(after)


def _variance(sd: float | None) -> float | None:
    return None if sd is None else sd**2


error_held = Figure("mean error before loss", lambda run: run.score.held.error)
error_all = Figure("mean error", lambda run: run.score.all.error)
abs_x = Figure("mean |error| in X", lambda run: run.score.all.abs_x)
abs_y = Figure("mean |error| in Y", lambda run: run.score.all.abs_y)
variance_x = Figure("variance in X", lambda run: _variance(run.score.all.sd_x))
variance_y = Figure("variance in Y", lambda run: _variance(run.score.all.sd_y))
lost = Figure("lost", lambda run: run.score.lost)
"""Yes or no: over seeds, a share."""
off_share = Figure("share of frames off", lambda run: run.score.off_share)
cpu = Figure("CPU time", lambda run: run.score.cpu_ms_median)
"""Median CPU time of a step, ms. Other programs on the machine do not lengthen it."""
wall = Figure("wall time", lambda run: run.score.ms_median)
"""Median wall time of a step, ms. An external tracker takes no CPU time of this process."""
detected = Figure("detections", lambda run: _share(run, run.trace.errors <= OFF_PX))
"""Share of the scored frames with status `tracking` and a centre error of at most OFF_PX."""
missed = Figure("missed detections", _missed)
false_alarms = Figure("false alarms", lambda run: _share(run, run.trace.errors > OFF_PX))
"""Share of the scored frames with status `tracking` and a larger centre error."""
frames_until_back = Figure("frames until back", _frames_until_back)
"""Frames from the end of the first occlusion until the estimate is on the target; inf: never; None: no occlusion."""


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
    """Return the figure of runs without track loss; None of others."""
    return Figure(figure.words, lambda run: None if run.score.lost else figure(run))


def _rule(words: str, figure: Figure, labels: tuple[str, ...], test: Callable[..., bool | None]) -> Rule:
    """Return the rule that tests the figure of each tracker; a run without the figure cannot decide."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        values = [value for label in labels if (value := figure(runs[label])) is not None]
        return test(*values) if len(values) == len(labels) else None

    return Rule(words, labels, of)


def holds(label: str) -> Rule:
    """Return the rule that the tracker does not lose the target."""
    return Rule(f"{label} is not lost", (label,), lambda runs: not runs[label].score.lost)


def loses(label: str) -> Rule:
    """Return the rule that the tracker loses the target."""
    return _rule(f"{label} is lost", lost, (label,), bool)


def less(figure: Figure, label: str, other: str) -> Rule:
    """Return the rule that a figure of one tracker is less than that of another; equal figures do not decide."""
    words = f"{figure.words} of {label} below that of {other}"
    return _rule(words, figure, (label, other), lambda own, its: None if own == its else own < its)


def at_most(figure: Figure, label: str, limit: float, unit: str = "") -> Rule:
    """Return the rule that a figure is at most a printed limit."""
    words = f"{figure.words} of {label} at or below {limit:g}{unit}"
    return _rule(words, figure, (label,), lambda own: own <= limit)


def times(figure: Figure, label: str, factor: float, other: str) -> Rule:
    """Return the rule that a figure of one tracker is at least `factor` times that of another."""
    words = f"{figure.words} of {label} at least {factor:g} times that of {other}"
    return _rule(words, figure, (label, other), lambda own, its: own >= factor * its)


def as_long(label: str, other: str, within: float) -> Rule:
    """Return the rule that two trackers take the same CPU time for a step, to within a share of the other's."""
    words = f"CPU time of {label} within {100 * within:g} % of that of {other}"
    return _rule(words, cpu, (label, other), lambda own, its: abs(own - its) <= within * its)


def nearly(figure: Figure, label: str, other: str, within: float) -> Rule:
    """Return the rule that a figure of two trackers differs by at most `within`."""
    words = f"{figure.words} of {label} within {within:g} of that of {other}"
    return _rule(words, figure, (label, other), lambda own, its: abs(own - its) <= within)


def on_target(label: str, first: int, last: int) -> Rule:
    """Return the rule that the mean centre error over frames first .. last is at most OFF_PX."""
    return at_most(error_over(first, last), label, OFF_PX, " px")


def back_in_time(label: str) -> Rule:
    """Return the rule that the tracker is on the target within BACK_WITHIN frames of its first return."""
    words = f"{label} is on the target within {BACK_WITHIN} frames of its return"
    return _rule(words, frames_until_back, (label,), lambda back: back <= BACK_WITHIN)


def mostly_nearer(label: str, other: str) -> Rule:
    """Return the rule that one tracker is nearer to the target than another in more than half of the frames."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = runs[label].trace, runs[other].trace
        return bool(np.mean((own.errors < its.errors)[own.scored]) > 0.5) if own.scored.any() else None

    return Rule(f"{label} nearer than {other} in more than half of the frames", (label, other), of)


def loses_about(label: str, frame: int, within: int) -> Rule:
    """Return the rule that the tracker loses the target within some frames of a frame; without a loss: no."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        score = runs[label].score
        return None if score.lost is None else score.lost_at is not None and abs(score.lost_at - frame) <= within

    return Rule(f"{label} is lost within {within} frames of frame {frame}", (label,), of)
