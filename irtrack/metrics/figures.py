"""Metrics ("figures") of `irtrack.metrics.Score`, each a function of a trace; nan where undefined."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from irsim.types import Floats
from irtrack.metrics import status
from irtrack.metrics.centre_error import (
    PRECISION_NORM,
    area,
    normalised_errors,
    precision_curve,
)
from irtrack.metrics.overlap import success_curve, success_rate, widened
from irtrack.metrics.statistics import share
from irtrack.metrics.trace import Trace


@dataclass(frozen=True)
class Figure:
    """Description of a metric.

    of      function of a trace, `ManyFigures` or `DetectionFigures`; None: a field of `CentreFigures`
    better  direction of better values
    most    upper bound of a metric with the lower bound 0
    kind    type of its values, each of which may be None
    """

    of: Callable[[Any], float | int | bool | None] | None
    unit: str = ""
    better: Literal["less", "more"] | None = None
    most: float = math.inf
    kind: type = float


def _less(of: Callable[[Trace], float | bool | None]) -> Figure:
    """Return the description of a share or boolean of which the smaller value is better."""
    return Figure(of, "", "less", 1.0)


def _more(of: Callable[[Trace], float]) -> Figure:
    """Return the description of a share of which the larger value is better."""
    return Figure(of, "", "more", 1.0)


def _precision(trace: Trace, px: float) -> float:
    return float(precision_curve(trace.errors[trace.scored], np.array([px]), _within_accuracy(trace))[0])


def _precision_norm(trace: Trace) -> float:
    errors = normalised_errors(trace.centers, trace.truth_centers, widened(trace.truth_sizes))[trace.scored]
    return area(precision_curve(errors, PRECISION_NORM, _within_accuracy(trace)))


def _within_accuracy(trace: Trace) -> np.ndarray:
    return np.asarray((trace.errors <= trace.accuracy)[trace.scored])


def _reacquired_after(trace: Trace) -> float:
    return _mean(
        np.array(
            [each.after for each in trace.returns if each.after is not None],
            dtype=np.float64,
        )
    )


def _mean(values: Floats) -> float:
    """Return the mean of the values that are not nan; nan without any."""
    known = values[~np.isnan(values)]
    return float(known.sum() / len(known)) if len(known) else np.nan


def _median(values: Floats) -> float:
    """Return the median; nan without values."""
    if len(values) == 0:
        return np.nan
    ordered = np.sort(values)  # np.median takes ten times as long for the few frames of a short track
    return float((ordered[(len(values) - 1) // 2] + ordered[len(values) // 2]) / 2)


OF_TRACE: dict[str, Figure] = {
    "frames": Figure(lambda trace: int(trace.scored.sum()), "frames"),
    "counted_frames": Figure(lambda trace: int(trace.counted.sum()), "frames"),
    "held_frames": Figure(lambda trace: int(trace.held.sum()), "frames", "more"),
    "lost": _less(lambda trace: trace.lost_position is not None if trace.scored.any() else None),
    "lost_at": Figure(
        lambda trace: None if trace.lost_position is None else int(trace.indices[trace.lost_position]),
        "frame",
    ),
    "off_share": _less(lambda trace: share(trace.off[trace.counted])),
    "precision_5": _more(lambda trace: _precision(trace, 5.0)),
    "precision_20": _more(lambda trace: _precision(trace, 20.0)),
    "precision_norm": _more(_precision_norm),
    "success_auc": _more(lambda trace: area(success_curve(trace.overlaps[trace.scored]))),
    "overlap": _more(lambda trace: _mean(trace.overlaps[trace.scored])),
    "success_50": _more(lambda trace: success_rate(trace.overlaps[trace.scored], 0.5)),
    "success_75": _more(lambda trace: success_rate(trace.overlaps[trace.scored], 0.75)),
    "lt_precision": _more(lambda trace: trace.long_term.precision),
    "lt_recall": _more(lambda trace: trace.long_term.recall),
    "lt_f": _more(lambda trace: trace.long_term.f),
    "returns": Figure(lambda trace: len(trace.returns)),
    "reacquired": Figure(lambda trace: sum(each.after is not None for each in trace.returns), "", "more"),
    "reacquired_after": Figure(_reacquired_after, "frames", "less"),
    "false_tracking": _less(lambda trace: status.false_tracking(trace.statuses, trace.off, trace.counted)),
    "false_lost": _less(lambda trace: status.false_lost(trace.statuses, trace.off, trace.counted)),
    "hidden_tracking": _less(lambda trace: status.hidden_tracking(trace.statuses, trace.scored & (trace.visible == 0))),
    "lost_late": Figure(
        lambda trace: status.lost_late(trace.statuses, trace.lost_position),
        "frames",
        "less",
    ),
    "nees": Figure(lambda trace: _mean(status.nees(trace.offsets, trace.covariances)[trace.held])),
    "neff": Figure(lambda trace: _mean(trace.neffs[1:])),
    "ms_mean": Figure(lambda trace: _mean(trace.step_ms[1:]), "ms", "less"),
    "ms_median": Figure(lambda trace: _median(trace.step_ms[1:]), "ms", "less"),
    "cpu_ms_mean": Figure(lambda trace: _mean(trace.cpu_ms[1:]), "ms", "less"),
    "cpu_ms_median": Figure(lambda trace: _median(trace.cpu_ms[1:]), "ms", "less"),
}
"""Metrics of a trace by name; their types are those of the fields of `Score`."""
