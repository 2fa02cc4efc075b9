"""The three charts of a source: error over time, precision and success, all seeds of each tracker together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim.types import Floats
from irtrack.metrics import Trace
from irtrack.metrics.centre import PRECISION_PX, centre_errors, precision_curve
from irtrack.metrics.loss import OFF_PX
from irtrack.metrics.overlap import SUCCESS, overlaps, success_curve, widened
from irtrack.report.charts import Axis, Line, line_chart
from irtrack.report.palette import Look

LEAST_ERROR = 0.1
"""Errors below this lie on the axis, px: a logarithmic axis has no zero."""

Traces = Mapping[str, Sequence[Trace]]
"""The traces of all seeds by the tracker's label."""


@dataclass(frozen=True)
class Plots:
    """SVG elements."""

    error: str
    precision: str
    success: str


def plots(traces: Traces, looks: Mapping[str, Look], name: str) -> Plots | None:
    """The charts of a source of that name; None where no frame has truth."""
    every = [trace for seeds in traces.values() for trace in seeds]
    if not any(np.isfinite(trace.truth_centers).any() for trace in every):
        return None
    return Plots(
        error=error_chart(traces, every, looks, name),
        precision=line_chart(
            [Line(looks[label], PRECISION_PX, _mean_precision(seeds)) for label, seeds in traces.items()],
            Axis("threshold on the centre error, px", (0, PRECISION_PX[-1])),
            Axis("share of frames within it", (0, 1.02)),
            size=(450, 280),
            name=f"{name}: precision curve",
        ),
        success=line_chart(
            [Line(looks[label], SUCCESS, _mean_success(seeds)) for label, seeds in traces.items()],
            Axis("threshold on the overlap (intersection over union)", (0, 1)),
            Axis("share of frames above it", (0, 1.02)),
            size=(450, 280),
            name=f"{name}: success curve",
        ),
    )


def error_chart(traces: Traces, every: Sequence[Trace], looks: Mapping[str, Look], name: str) -> str:
    frames = np.unique(np.concatenate([trace.indices for trace in every]))
    lines, largest = [], OFF_PX
    for label, seeds in traces.items():
        low, middle, high = quartiles(frames, seeds)
        largest = max(largest, float(np.nanmax(high, initial=OFF_PX)))
        band = (low, high) if len(seeds) > 1 else (None, None)
        lines.append(Line(looks[label], frames, middle, *band))
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


def quartiles(frames: np.ndarray, seeds: Sequence[Trace]) -> tuple[Floats, Floats, Floats]:
    """(len(frames),) each: quartiles over the seeds of the centre error, px, never under LEAST_ERROR.

    nan in frames where no seed has a true centre: the line breaks there.
    """
    table = np.full((len(seeds), len(frames)), np.nan)
    for row, trace in zip(table, seeds, strict=True):
        row[np.searchsorted(frames, trace.indices)] = centre_errors(trace.centers, trace.truth_centers)
    known = np.isfinite(table).any(axis=0)
    result = np.full((3, len(frames)), np.nan)
    if known.any():
        result[:, known] = np.nanpercentile(table[:, known], (25, 50, 75), axis=0)
    low, middle, high = np.maximum(result, LEAST_ERROR)
    return low, middle, high


def hidden_spans(frames: np.ndarray, traces: Sequence[Trace]) -> list[tuple[float, float]]:
    """Spans of frames in which, in most of the traces, less than half of the target is visible."""
    votes = np.zeros(len(frames))
    for trace in traces:
        absent = ~np.isfinite(trace.truth_centers).all(axis=1)
        votes[np.searchsorted(frames, trace.indices)] += np.where(absent | (trace.visible < 0.5), 1, -1)
    hidden = np.concatenate([[False], votes > 0, [False]])
    starts = np.flatnonzero(hidden[1:] & ~hidden[:-1])
    stops = np.flatnonzero(hidden[:-1] & ~hidden[1:])
    return [
        (float(frames[start]) - 0.5, float(frames[stop - 1]) + 0.5) for start, stop in zip(starts, stops, strict=True)
    ]


def _scored(trace: Trace) -> np.ndarray:
    """(n,) bool: frames that enter a score: the target is present, and it is not the start frame."""
    present = np.asarray(np.isfinite(trace.truth_centers).all(axis=1))
    return np.asarray(present & (np.arange(len(present)) > 0))


def _mean_precision(seeds: Sequence[Trace]) -> Floats:
    curves = []
    for trace in seeds:
        errors = centre_errors(trace.centers, trace.truth_centers)
        scored = _scored(trace)
        curves.append(precision_curve(errors[scored], PRECISION_PX, (errors <= trace.accuracy)[scored]))
    return _mean(curves)


def _mean_success(seeds: Sequence[Trace]) -> Floats:
    curves = []
    for trace in seeds:
        scored = _scored(trace)
        overlap = overlaps(trace.centers, widened(trace.sizes), trace.truth_centers, widened(trace.truth_sizes))
        curves.append(success_curve(overlap[scored]))
    return _mean(curves)


def _mean(curves: Sequence[Floats]) -> Floats:
    """The mean curve of those that have a scored frame."""
    known = [curve for curve in curves if np.isfinite(curve).all()]
    return np.mean(known, axis=0) if known else np.full_like(curves[0], np.nan)
