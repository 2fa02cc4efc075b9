"""Figures of `irtrack.metrics.Score`, each as a function of a trace; nan where no frame gives one."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats
from irtrack.metrics import status
from irtrack.metrics.centre_error import PRECISION_NORM, area, normalised_errors, precision_curve
from irtrack.metrics.overlap import success_curve, success_rate, widened
from irtrack.metrics.statistics import share
from irtrack.metrics.trace import Trace


def frames(trace: Trace) -> int:
    return int(trace.scored.sum())


def counted_frames(trace: Trace) -> int:
    return int(trace.counted.sum())


def held_frames(trace: Trace) -> int:
    return int(trace.held.sum())


def lost(trace: Trace) -> bool | None:
    return trace.lost_position is not None if trace.scored.any() else None


def lost_at(trace: Trace) -> int | None:
    return None if trace.lost_position is None else int(trace.indices[trace.lost_position])


def off_share(trace: Trace) -> float:
    return share(trace.off[trace.counted])


def precision_5(trace: Trace) -> float:
    return _precision(trace, 5.0)


def precision_20(trace: Trace) -> float:
    return _precision(trace, 20.0)


def _precision(trace: Trace, px: float) -> float:
    return float(precision_curve(trace.errors[trace.scored], np.array([px]), _within_accuracy(trace))[0])


def precision_norm(trace: Trace) -> float:
    errors = normalised_errors(trace.centers, trace.truth_centers, widened(trace.truth_sizes))[trace.scored]
    return area(precision_curve(errors, PRECISION_NORM, _within_accuracy(trace)))


def _within_accuracy(trace: Trace) -> np.ndarray:
    return np.asarray((trace.errors <= trace.accuracy)[trace.scored])


def success_auc(trace: Trace) -> float:
    return area(success_curve(trace.overlaps[trace.scored]))


def overlap(trace: Trace) -> float:
    return _mean(trace.overlaps[trace.scored])


def success_50(trace: Trace) -> float:
    return success_rate(trace.overlaps[trace.scored], 0.5)


def success_75(trace: Trace) -> float:
    return success_rate(trace.overlaps[trace.scored], 0.75)


def lt_precision(trace: Trace) -> float:
    return trace.long_term.precision


def lt_recall(trace: Trace) -> float:
    return trace.long_term.recall


def lt_f(trace: Trace) -> float:
    return trace.long_term.f


def returns(trace: Trace) -> int:
    return len(trace.returns)


def reacquired(trace: Trace) -> int:
    return sum(each.after is not None for each in trace.returns)


def reacquired_after(trace: Trace) -> float:
    return _mean(np.array([each.after for each in trace.returns if each.after is not None], dtype=np.float64))


def false_tracking(trace: Trace) -> float:
    return status.false_tracking(trace.statuses, trace.off, trace.counted)


def false_lost(trace: Trace) -> float:
    return status.false_lost(trace.statuses, trace.off, trace.counted)


def hidden_tracking(trace: Trace) -> float:
    return status.hidden_tracking(trace.statuses, trace.scored & (trace.visible == 0))


def lost_late(trace: Trace) -> float:
    return status.lost_late(trace.statuses, trace.lost_position)


def nees(trace: Trace) -> float:
    return _mean(status.nees(trace.offsets, trace.covariances)[trace.held])


def neff(trace: Trace) -> float:
    return _mean(trace.neffs[1:])


def ms_mean(trace: Trace) -> float:
    return _mean(trace.step_ms[1:])


def ms_median(trace: Trace) -> float:
    return _median(trace.step_ms[1:])


def cpu_ms_mean(trace: Trace) -> float:
    return _mean(trace.cpu_ms[1:])


def cpu_ms_median(trace: Trace) -> float:
    return _median(trace.cpu_ms[1:])


def _mean(values: Floats) -> float:
    """Return the mean of the known values; nan of none."""
    known = values[~np.isnan(values)]
    return float(known.sum() / len(known)) if len(known) else np.nan


def _median(values: Floats) -> float:
    """Return the median; nan of no values."""
    if len(values) == 0:
        return np.nan
    ordered = np.sort(values)  # np.median takes ten times as long for the few frames of a short track
    return float((ordered[(len(values) - 1) // 2] + ordered[len(values) // 2]) / 2)
