"""Charts as inline SVG."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from irsim.types import SHOWN, Floats
from irtrack.metrics import Survival, Trace, mean_interval
from irtrack.metrics.bound import TargetBound, ratios_by_d
from irtrack.metrics.centre_error import PRECISION_PX, precision_curve
from irtrack.metrics.lost import OFF_PX
from irtrack.metrics.overlap import SUCCESS, success_curve
from irtrack.report.line_styles import LineStyle

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Placeholder colours, replaced by those of the page in its light and dark scheme.
INK, GRID = "#010203", "#040506"
PAGE_COLORS = {INK: "currentColor", GRID: "var(--line)"}

POINTS_PER_PX = 0.72  # Figure sizes are inches of 100 px; matplotlib measures lines and text in points.


@dataclass(frozen=True, eq=False)
class Line:
    """Line of one tracker: x, y (n,), and the lower and upper edge of its band, if any."""

    style: LineStyle
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True)
class Axis:
    """Axis of a chart: label, limits (None: from the data), whether logarithmic, and ticks if given."""

    label: str
    limits: tuple[float, float] | None = None
    log: bool = False
    ticks: tuple[float, ...] = ()


def line_chart(
    lines: Sequence[Line],
    x: Axis,
    y: Axis,
    *,
    size: tuple[int, int],
    name: str,
    shaded: Sequence[tuple[float, float]] = (),
    level: float | None = None,
) -> str:
    """Draw lines as an <svg> element of `size` (width, height) px.

    shaded  intervals of x to shade;  level  y of a dashed horizontal line
    name    label for screen readers, which also makes element ids unique within a page
    """
    import matplotlib
    from matplotlib.figure import Figure

    settings: dict[Any, Any] = {
        "svg.fonttype": "none",  # writes text as text, not as outlines
        "svg.hashsalt": name,  # reproducible ids
        "font.size": 12 * POINTS_PER_PX,
        "text.color": INK,
        "axes.labelcolor": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "axes.edgecolor": GRID,
        "grid.color": GRID,
        "grid.linewidth": 1 * POINTS_PER_PX,
        "path.simplify_threshold": 0.5,
    }
    with matplotlib.rc_context(settings):
        figure = Figure(figsize=(size[0] / 100, size[1] / 100), layout="constrained")
        axes = figure.add_subplot()
        for start, stop in shaded:
            axes.axvspan(start, stop, color=GRID, linewidth=0)
        if level is not None:
            axes.axhline(level, color=INK, linewidth=1 * POINTS_PER_PX, alpha=0.5, linestyle=(0, (4, 4)))
        for line in lines:
            _draw(axes, line)
        _finish(axes, x, y)
        buffer = io.StringIO()
        no_metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(buffer, format="svg", transparent=True, metadata=no_metadata)
    return _inline(buffer.getvalue(), name)


def _draw(axes: Axes, line: Line) -> None:
    width = 2 * POINTS_PER_PX
    pattern = (0, tuple(length / width for length in line.style.dash)) if line.style.dash else "-"
    axes.plot(line.x, line.y, color=line.style.color, linewidth=width, linestyle=pattern)
    if line.low is not None and line.high is not None:
        axes.fill_between(line.x, line.low, line.high, color=line.style.color, alpha=0.2, linewidth=0)


def _finish(axes: Axes, x: Axis, y: Axis) -> None:
    axes.set_xlabel(x.label)
    axes.set_ylabel(y.label)
    if x.log:
        axes.set_xscale("log")
    if y.log:
        axes.set_yscale("log")
    for axis, given in ((axes.xaxis, x), (axes.yaxis, y)):
        if given.ticks:
            axis.set_ticks(given.ticks)
        if given.log:
            axis.set_minor_formatter("")
        axis.set_major_formatter("{x:g}")
    if x.limits:
        axes.set_xlim(*x.limits)
    else:
        axes.margins(x=0)
    if y.limits:
        axes.set_ylim(*y.limits)
    axes.grid(axis="y")
    axes.tick_params(which="both", length=0, pad=5)
    axes.spines[["top", "right", "left"]].set_visible(False)


def _inline(svg: str, name: str) -> str:
    """Return an SVG file as an element of a page: without prologue and group ids, in the page's colours."""
    element = svg[svg.index("<svg") :]
    element = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", element, count=1, flags=re.DOTALL)
    element = re.sub(r'<g id="[^"]*"', "<g", element)
    element = re.sub(r"font: ([\d.]+)px[^;\"]*", r"font: \1px system-ui, sans-serif", element)
    for color, replacement in PAGE_COLORS.items():
        element = element.replace(color, replacement)
    view = re.search(r'viewBox="[^"]*"', element)
    opening = f'<svg class="chart" role="img" aria-label="{escape(name)}" {view.group() if view else ""}>'
    return re.sub(r"<svg [^>]*>", lambda _: opening, element, count=1)


LEAST_ERROR = 0.1
"""Lower end of the logarithmic axis of errors, px."""

LEAST_BOUND = 0.01
"""Lower end of the axis where it shows the bound too, px."""

POINTS = 300
"""Largest number of points of a line over time; frames of longer tracks are grouped."""

SMALL = (360, 260)
"""(Width, height) of charts side by side, px."""

BOUND_STYLE = LineStyle(INK, (2, 2))
"""Style of the bound in the chart of errors."""

Traces = Mapping[str, Sequence[Trace]]
"""The traces of all seeds by the tracker's label."""


@dataclass(frozen=True)
class Plots:
    """Charts of a source as SVG elements; `bound`: None without bounds that hold."""

    error: str
    precision: str
    success: str
    held: str
    bound: str | None = None


def plots(
    traces: Traces,
    survival: Mapping[str, Survival],
    styles: Mapping[str, LineStyle],
    name: str,
    bounds: Sequence[TargetBound] = (),
    bounded: Mapping[str, tuple[list[Trace], list[TargetBound]]] | None = None,
) -> Plots | None:
    """Draw the charts of a source; None where no frame has truth.

    bounds    those of the targets in its scenes;  bounded   traces with their bounds, by the tracker's label
    """
    every = [trace for seeds in traces.values() for trace in seeds]
    if not any(np.isfinite(trace.truth_centers).any() for trace in every):
        return None
    return Plots(
        error=error_chart(traces, every, styles, name, bounds),
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
        bound=bound_chart(bounded or {}, styles, name),
    )


def bound_chart(
    bounded: Mapping[str, tuple[list[Trace], list[TargetBound]]], styles: Mapping[str, LineStyle], name: str
) -> str | None:
    """Draw the error over the bound against d, with its interval; None where no frame has a bound that holds."""
    curves = {label: curve for label, each in bounded.items() if len(curve := ratios_by_d(*each))}
    if not curves:
        return None
    lines = [Line(styles[label], *curve.T) for label, curve in curves.items()]
    every = np.concatenate(list(curves.values()))
    (low, least), (high, most) = every[:, :2].min(axis=0).tolist(), every[:, :2].max(axis=0).tolist()
    return line_chart(
        lines,
        Axis("d", (0.95 * low, 1.05 * high), log=True),
        Axis(
            "error / bound",
            (max(min(0.5, least), 0.01), 1.5 * max(most, 1.0)),
            log=True,
        ),
        size=SMALL,
        name=f"{name}: error over the bound",
        level=1.0,
    )


def error_chart(
    traces: Traces,
    every: Sequence[Trace],
    styles: Mapping[str, LineStyle],
    name: str,
    bounds: Sequence[TargetBound] = (),
) -> str:
    """Draw the centre error over frames, median and quartiles over the seeds; occlusions shaded.

    bounds of the scenes: the median of their bounds on the root mean square error is drawn, too
    """
    frames = np.unique(np.concatenate([trace.indices for trace in every]))
    lines, largest = [], OFF_PX
    grouped = -(-len(frames) // POINTS)
    x = frames[::grouped].astype(np.float64)
    for label, seeds in traces.items():
        low, middle, high = quartiles(frames, seeds, grouped, LEAST_BOUND if bounds else LEAST_ERROR)
        largest = max(largest, float(np.nanmax(high, initial=OFF_PX)))
        band = (low, high) if len(seeds) > 1 else (None, None)
        lines.append(Line(styles[label], x, middle, *band))
    if bounds:
        lines.append(Line(BOUND_STYLE, x, least_errors(frames, bounds, grouped)))
    diagonals = np.concatenate([np.hypot(*trace.truth_sizes.T) for trace in every])
    return line_chart(
        lines,
        Axis("frame", (float(frames[0]), float(frames[-1]) if len(frames) > 1 else float(frames[0]) + 1)),
        Axis("centre error, px", (LEAST_BOUND if bounds else LEAST_ERROR, 2 * largest), log=True),
        size=(900, 270),
        name=f"{name}: centre error over time",
        shaded=hidden_spans(frames, every),
        level=max(OFF_PX, float(np.nanmedian(diagonals))),
    )


def least_errors(frames: np.ndarray, bounds: Sequence[TargetBound], grouped: int = 1) -> Floats:
    """Return the median over scenes and grouped frames of the bound on the root mean square centre error, (groups,) px;
    nan where there is none."""
    groups = -(-len(frames) // grouped)
    table = np.full((len(bounds), groups * grouped), np.nan)
    for row, bound in zip(table, bounds, strict=True):
        row[: len(frames)] = np.hypot(*bound.at(frames)[0].T)
    table = table.reshape(len(bounds), groups, grouped).swapaxes(0, 1).reshape(groups, -1)
    known = np.isfinite(table).any(axis=1)
    found = np.full(groups, np.nan)
    if known.any():
        found[known] = np.maximum(np.nanmedian(table[known], axis=1), LEAST_BOUND)
    return found


def quartiles(
    frames: np.ndarray, seeds: Sequence[Trace], grouped: int = 1, least: float = LEAST_ERROR
) -> tuple[Floats, Floats, Floats]:
    """Return quartiles (groups,) of the centre error over the seeds, px, at least `least`; nan without truth.

    grouped   number of successive frames of one group, whose errors are pooled
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
    low, middle, high = np.maximum(result, least)
    return low, middle, high


def hidden_spans(frames: np.ndarray, traces: Sequence[Trace]) -> list[tuple[float, float]]:
    """Return the intervals of frames in which less than half of the target is visible in most traces."""
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
    """Return the precision curves (runs, thresholds) of the runs with scored frames."""
    known = [trace for trace in seeds if trace.scored.any()]
    right = [(trace.errors <= trace.accuracy)[trace.scored] for trace in known]
    pairs = zip(known, right, strict=True)
    curves = [precision_curve(trace.errors[trace.scored], PRECISION_PX, near) for trace, near in pairs]
    return np.array(curves).reshape(len(known), len(PRECISION_PX))


def _successes(seeds: Sequence[Trace]) -> Floats:
    """Return the success curves (runs, thresholds) of the runs with scored frames."""
    curves = [success_curve(trace.overlaps[trace.scored]) for trace in seeds if trace.scored.any()]
    return np.array(curves).reshape(len(curves), len(SUCCESS))


def _banded(style: LineStyle, x: Floats, curves: Floats) -> Line:
    """Return the mean of curves (runs, n) with its 95 % interval at each x, Student's t over the runs."""
    if not len(curves):
        return Line(style, x, np.full_like(x, np.nan))
    mean, low, high = mean_interval(curves)
    if len(curves) == 1:
        return Line(style, x, mean)
    return Line(style, x, mean, np.clip(low, 0, 1), np.clip(high, 0, 1))


def _steps(style: LineStyle, held: Survival, last: int) -> Line:
    """Return the step function of the share without loss, from the start to the last frame."""
    x = np.repeat(np.concatenate([[0.0], held.times, [float(last)]]), 2)[1:-1]
    y, low, high = (np.repeat(np.concatenate([[1.0], each]), 2) for each in (held.held, held.low, held.high))
    return Line(style, x, y, low, high)
