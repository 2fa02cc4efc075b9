"""Line charts as inline SVG that takes its text and grid colours from the page's style."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from irsim.types import Floats
from irtrack.report.palette import LineStyle

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Colours that no tracker has: they stand for the page's own, so that one chart serves light and dark.
INK, GRID = "#010203", "#040506"
PAGE_COLORS = {INK: "currentColor", GRID: "var(--line)"}

POINTS_PER_PX = 0.72  # Figure sizes are inches of 100 px; matplotlib measures lines and text in points.


@dataclass(frozen=True, eq=False)
class Line:
    """One tracker's line: x, y (n,), and the edges of a band where there is one."""

    style: LineStyle
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True)
class Axis:
    """An axis: what it shows, its limits (None: from the data), whether it is logarithmic, its ticks where given."""

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
    """An <svg> element of that size in px.

    shaded  spans of x to shade;  level  a dashed line across
    name    read to those who cannot see it; it also makes the ids unique within a page
    """
    import matplotlib
    from matplotlib.figure import Figure

    settings: dict[Any, Any] = {
        "svg.fonttype": "none",  # text stays text: small, selectable
        "svg.hashsalt": name,  # ids from this, not from a random number: the same report each time
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
    """A whole SVG file as an element of a page: no prologue, no group ids, the page's colours, any width."""
    element = svg[svg.index("<svg") :]
    element = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", element, count=1, flags=re.DOTALL)
    element = re.sub(r'<g id="[^"]*"', "<g", element)
    element = re.sub(r"font: ([\d.]+)px[^;\"]*", r"font: \1px system-ui, sans-serif", element)
    for color, replacement in PAGE_COLORS.items():
        element = element.replace(color, replacement)
    view = re.search(r'viewBox="[^"]*"', element)
    opening = f'<svg class="chart" role="img" aria-label="{escape(name)}" {view.group() if view else ""}>'
    return re.sub(r"<svg [^>]*>", lambda _: opening, element, count=1)
