"""The rules that claims are tested by, seed by seed, and the figures that they compare."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from irtrack.metrics.lost import OFF_PX
from irtrack.papers.values import Rule, Run

BACK_WITHIN = 5
"""Frames within which a tracker has to be back on its target."""


def holds(label: str) -> Rule:
    """It does not lose the target."""
    return Rule(f"{label} is not lost", (label,), lambda runs: not runs[label].score.lost)


def loses(label: str) -> Rule:
    """It loses the target."""
    return Rule(f"{label} is lost", (label,), lambda runs: runs[label].score.lost)


def less(figure: Callable[[Run], float | None], what: str, label: str, other: str) -> Rule:
    """A figure of one tracker is less than that of another; where both are the same, the seed tells nothing."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = figure(runs[label]), figure(runs[other])
        return None if own is None or its is None or own == its else own < its

    return Rule(f"{what} of {label} below that of {other}", (label, other), of)


def at_most(figure: Callable[[Run], float | None], what: str, label: str, limit: float, given: str = "") -> Rule:
    """A figure of a tracker is at or below a printed one; a run without the figure says nothing."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own = figure(runs[label])
        return None if own is None else own <= limit

    return Rule(f"{what} of {label} at or below {limit:g}{given}", (label,), of)


def times(figure: Callable[[Run], float | None], what: str, label: str, factor: float, other: str) -> Rule:
    """A figure of one tracker is at least so many times that of another."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = figure(runs[label]), figure(runs[other])
        return None if own is None or its is None else own >= factor * its

    return Rule(f"{what} of {label} at least {factor:g} times that of {other}", (label, other), of)


def as_long(label: str, other: str, within: float) -> Rule:
    """A step of one tracker takes the CPU time of a step of another, give or take that share of it."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = cpu(runs[label]), cpu(runs[other])
        return None if own is None or its is None else abs(own - its) <= within * its

    return Rule(f"CPU time of {label} within {100 * within:g} % of that of {other}", (label, other), of)


def mostly_nearer(label: str, other: str) -> Rule:
    """One tracker is nearer to the target than another in more than half of the frames."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = runs[label].trace, runs[other].trace
        return bool(np.mean((own.errors < its.errors)[own.scored]) > 0.5) if own.scored.any() else None

    return Rule(f"{label} nearer than {other} in more than half of the frames", (label, other), of)


def loses_about(label: str, frame: int, within: int) -> Rule:
    """It loses the target no farther than `within` frames from a frame; a run that keeps it says no."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        score = runs[label].score
        return None if score.lost is None else score.lost_at is not None and abs(score.lost_at - frame) <= within

    return Rule(f"{label} is lost within {within} frames of frame {frame}", (label,), of)


def on_target(label: str, first: int, last: int) -> Rule:
    """Its mean centre error over frames first .. last is at most OFF_PX."""
    return at_most(error_over(first, last), f"mean error in frames {first} to {last}", label, OFF_PX, " px")


def nearly(figure: Callable[[Run], float | None], what: str, label: str, other: str, within: float) -> Rule:
    """A figure of two trackers differs by no more than that."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        own, its = figure(runs[label]), figure(runs[other])
        return None if own is None or its is None else abs(own - its) <= within

    return Rule(f"{what} of {label} within {within:g} of that of {other}", (label, other), of)


def back_in_time(label: str) -> Rule:
    """It is back on the target within BACK_WITHIN frames of its return."""

    def of(runs: Mapping[str, Run]) -> bool | None:
        back = frames_until_back(runs[label])
        return None if back is None else back <= BACK_WITHIN

    return Rule(f"{label} is on the target within {BACK_WITHIN} frames of its return", (label,), of)


def error_held(run: Run) -> float | None:
    """Mean centre error of the frames before the loss, px."""
    return run.score.held.error


def error_all(run: Run) -> float | None:
    """Mean centre error of all scored frames, px."""
    return run.score.all.error


def lost(run: Run) -> bool | None:
    """Whether the track is lost: over seeds, a share of yes and no."""
    return run.score.lost


def off_share(run: Run) -> float | None:
    return run.score.off_share


def cpu(run: Run) -> float | None:
    """Median CPU time of a step, ms: other programs on the machine do not lengthen it."""
    return run.score.cpu_ms_median


def wall(run: Run) -> float | None:
    """Median wall time of a step, ms: of a program of its own this process takes no CPU time."""
    return run.score.ms_median


def _over(first: int, last: int, run: Run) -> float | None:
    errors = run.trace.errors[(run.trace.indices >= first) & (run.trace.indices <= last) & run.trace.scored]
    return float(np.mean(errors)) if len(errors) else None


def error_over(first: int, last: int) -> Callable[[Run], float | None]:
    """Mean centre error of frames first .. last, px."""
    return partial(_over, first, last)


def unless_lost(figure: Callable[[Run], float | None]) -> Callable[[Run], float | None]:
    """The figure of runs that are not lost; None of others."""
    return lambda run: None if run.score.lost else figure(run)


def variance_x(run: Run) -> float | None:
    """Variance of |error| along x over all scored frames, px^2."""
    return None if run.score.all.sd_x is None else run.score.all.sd_x**2


def variance_y(run: Run) -> float | None:
    """The same along y."""
    return None if run.score.all.sd_y is None else run.score.all.sd_y**2


def missed(run: Run) -> float | None:
    """Share of the scored frames in which the target is not `detected`."""
    found = detected(run)
    return None if found is None else 1 - found


def abs_x(run: Run) -> float | None:
    return run.score.all.abs_x


def abs_y(run: Run) -> float | None:
    return run.score.all.abs_y


def frames_until_back(run: Run) -> float | None:
    """Frames from the first time that the target is seen again until the centre is on it; None where never hidden."""
    returns = run.trace.returns
    if not returns:
        return None
    after = returns[0].after
    return float("inf") if after is None else float(after)


def score_between(first: int, last: int) -> Callable[[Run], float | None]:
    """Median of the tracker's own score in frames first .. last."""

    def of(run: Run) -> float | None:
        scores = run.trace.scores[(run.trace.indices >= first) & (run.trace.indices <= last)]
        return float(np.median(scores)) if len(scores) and np.isfinite(scores).all() else None

    return of


def detected(run: Run) -> float | None:
    """Share of the scored frames in which it says that it sees the target and is within OFF_PX px of it."""
    return _share(run, run.trace.errors <= OFF_PX)


def false_alarms(run: Run) -> float | None:
    """Share of the scored frames in which it says that it sees the target and is farther than that."""
    return _share(run, run.trace.errors > OFF_PX)


def _share(run: Run, hit: np.ndarray) -> float | None:
    scored = run.trace.scored
    return float(np.mean((hit & (run.trace.statuses == "tracking"))[scored])) if scored.any() else None
