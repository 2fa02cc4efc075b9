"""The charts of a source: error over time, precision, success and time to loss, all runs of each tracker together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim.types import SHOWN, Floats
from irtrack.metrics import Survival, Trace, mean_interval
from irtrack.metrics.centre import PRECISION_PX, precision_curve
from irtrack.metrics.loss import OFF_PX
from irtrack.metrics.overlap import SUCCESS, success_curve
from irtrack.report.charts import Axis, Line, line_chart
from irtrack.report.palette import LineStyle

LEAST_ERROR = 0.1
"""Errors below this lie on the axis, px: a logarithmic axis has no zero."""

POINTS = 300
"""A line over time has no more points than this: longer tracks are grouped."""

SMALL = (360, 260)
"""Size of a chart that stands beside another, px."""

Traces = Mapping[str, Sequence[Trace]]
"""The traces of all seeds by the tracker's label."""


@dataclass(frozen=True)
class Plots:
    """SVG elements."""

    error: str
    precision: str
    success: str
    held: str


def plots(traces: Traces, survival: Mapping[str, Survival], styles: Mapping[str, LineStyle], name: str) -> Plots | None:
    """The charts of a source of that name; None where no frame has truth."""
    every = [trace for seeds in traces.values() for trace in seeds]
    if not any(np.isfinite(trace.truth_centers).any() for trace in every):
        return None
    return Plots(
        error=error_chart(traces, every, styles, name),
        precision=line_chart(
            [_banded(styles[label], PRECISION_PX, _precisions(seeds)) for label, seeds in traces.items()],
            Axis("threshold on the centre error, px", (0, PRECISION_PX[-1])),
            Axis("share of frames within it", (0, 1.02)),
            size=SMALL,
            name=f"{name}: precision curve",
        ),
        success=line_chart(
            [_banded(styles[label], SUCCESS, _successes(seeds)) for label, seeds in traces.items()],
            Axis("threshold on the overlap (intersection over union)", (0, 1)),
            Axis("share of frames above it", (0, 1.02)),
            size=SMALL,
            name=f"{name}: success curve",
        ),
        held=line_chart(
            [
                _steps(styles[label], held, max(len(trace.indices) - 1 for trace in traces[label]))
                for label, held in survival.items()
            ],
            Axis("frames after the start"),
            Axis("share of runs still held", (0, 1.02)),
            size=SMALL,
            name=f"{name}: time to loss",
        ),
    )


def error_chart(traces: Traces, every: Sequence[Trace], styles: Mapping[str, LineStyle], name: str) -> str:
    frames = np.unique(np.concatenate([trace.indices for trace in every]))
    lines, largest = [], OFF_PX
    grouped = -(-len(frames) // POINTS)
    x = frames[::grouped].astype(np.float64)
    for label, seeds in traces.items():
        low, middle, high = quartiles(frames, seeds, grouped)
        largest = max(largest, float(np.nanmax(high, initial=OFF_PX)))
        band = (low, high) if len(seeds) > 1 else (None, None)
        lines.append(Line(styles[label], x, middle, *band))
    diagonals = np.concatenate([np.hypot(*trace.truth_sizes.T) for trace in every])
    return line_chart(
        lines,
        Axis("frame", (float(frames[0]), float(frames[-1]) if len(frames) > 1 else float(frames[0]) + 1)),
        Axis("centre error, px", (LEAST_ERROR, 2 * largest), log=True),
        size=(900, 270),
        name=f"{name}: centre error over time",
        shaded=hidden_spans(frames, every),
        level=max(OFF_PX, float(np.nanmedian(diagonals))),
    )


def quartiles(frames: np.ndarray, seeds: Sequence[Trace], grouped: int = 1) -> tuple[Floats, Floats, Floats]:
    """(groups,) each: quartiles over the seeds of the centre error, px, never under LEAST_ERROR.

    grouped   so many frames in a row are one group, all their errors taken together

    nan in groups where no seed has a true centre: the line breaks there.
    """
    groups = -(-len(frames) // grouped)
    table = np.full((len(seeds), groups * grouped), np.nan)
    for row, trace in zip(table, seeds, strict=True):
        row[np.searchsorted(frames, trace.indices)] = trace.errors
    table = table.reshape(len(seeds), groups, grouped).swapaxes(0, 1).reshape(groups, -1)
    known = np.isfinite(table).any(axis=1)
    result = np.full((3, groups), np.nan)
    if known.any():
        result[:, known] = np.nanpercentile(table[known], (25, 50, 75), axis=1)
    low, middle, high = np.maximum(result, LEAST_ERROR)
    return low, middle, high


def hidden_spans(frames: np.ndarray, traces: Sequence[Trace]) -> list[tuple[float, float]]:
    """Spans of frames in which, in most of the traces, less than half of the target is visible."""
    votes = np.zeros(len(frames))
    for trace in traces:
        absent = ~np.isfinite(trace.truth_centers).all(axis=1)
        votes[np.searchsorted(frames, trace.indices)] += np.where(absent | (trace.visible < SHOWN), 1, -1)
    hidden = np.concatenate([[False], votes > 0, [False]])
    starts = np.flatnonzero(hidden[1:] & ~hidden[:-1])
    stops = np.flatnonzero(hidden[:-1] & ~hidden[1:])
    return [
        (float(frames[start]) - 0.5, float(frames[stop - 1]) + 0.5) for start, stop in zip(starts, stops, strict=True)
    ]


def _precisions(seeds: Sequence[Trace]) -> Floats:
    """(runs, thresholds) the precision curve of each run that has a scored frame."""
    known = [trace for trace in seeds if trace.scored.any()]
    right = [(trace.errors <= trace.accuracy)[trace.scored] for trace in known]
    pairs = zip(known, right, strict=True)
    curves = [precision_curve(trace.errors[trace.scored], PRECISION_PX, near) for trace, near in pairs]
    return np.array(curves).reshape(len(known), len(PRECISION_PX))


def _successes(seeds: Sequence[Trace]) -> Floats:
    """(runs, thresholds) the success curve of each run that has a scored frame."""
    curves = [success_curve(trace.overlaps[trace.scored]) for trace in seeds if trace.scored.any()]
    return np.array(curves).reshape(len(curves), len(SUCCESS))


def _banded(style: LineStyle, x: Floats, curves: Floats) -> Line:
    """The mean of curves (runs, n) with its 95 % interval at each x, Student's t over the runs."""
    if not len(curves):
        return Line(style, x, np.full_like(x, np.nan))
    mean, low, high = mean_interval(curves)
    if len(curves) == 1:
        return Line(style, x, mean)
    return Line(style, x, mean, np.clip(low, 0, 1), np.clip(high, 0, 1))


def _steps(style: LineStyle, held: Survival, last: int) -> Line:
    """The step function of the share still held, from the start to the last frame."""
    x = np.repeat(np.concatenate([[0.0], held.times, [float(last)]]), 2)[1:-1]
    y, low, high = (np.repeat(np.concatenate([[1.0], each]), 2) for each in (held.held, held.low, held.high))
    return Line(style, x, y, low, high)
