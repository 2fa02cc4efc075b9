"""The charts of the page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from irsim.types import Floats
from irtrack.metrics import mean_interval, wilson
from irtrack.papers.growth import PARTICLES, Filtering, GrowthResult
from irtrack.papers.runs import Outcome
from irtrack.papers.values import Experiment, Run, Sweep
from irtrack.report.plots import Axis, Line, LineStyle, error_chart, line_chart, styles

SMALL = (450, 280)


def over_frames(experiment: Experiment, found: Outcome, style: Mapping[str, LineStyle]) -> str:
    """Centre error over frames, median and quartiles over the seeds; '' where nothing was run."""
    charted = experiment.charted or experiment.trackers
    traces = {label: [run.trace for run in found.of(label).values()] for label in charted}
    shown = {label: seeds for label, seeds in traces.items() if seeds}
    every = [trace for seeds in shown.values() for trace in seeds]
    return error_chart(shown, every, style, experiment.scene.name) if every else ""


def scores_over_frames(label: str, found: Outcome, style: LineStyle) -> str:
    """The tracker's own score over frames, median and quartiles over the seeds; '' where it has none."""
    runs = list(found.of(label).values())
    if not runs or not all(np.isfinite(run.trace.scores[1:]).all() for run in runs):
        return ""
    table = np.array([run.trace.scores[1:] for run in runs])
    low, middle, high = np.percentile(table, (25, 50, 75), axis=0)
    frames = runs[0].trace.indices[1:]
    return line_chart(
        [Line(style, frames, middle, low, high)],
        Axis("frame"),
        Axis("matching coefficient", (0, 1)),
        size=(900, 220),
        name=f"{found.source.name}: matching coefficient of {label}",
    )


def swept(
    sweep: Sweep,
    figure: str,
    of: Callable[[Run], float | None],
    outcomes: Mapping[str, Outcome],
    style: Mapping[str, LineStyle],
) -> str:
    """A figure's mean over the seeds against the setting, with its 95 % interval."""
    lines = []
    for label in sweep.labels:
        points = []
        for x, (scene, trackers) in sweep.points.items():
            runs = outcomes[scene.name].of(trackers[label]).values()
            values = [value for run in runs if (value := of(run)) is not None]
            if values:
                points.append((x, *interval(values)))
        if points:
            place, middle, low, high = np.array(points).T
            lines.append(Line(style[label], place, middle, low, high))
    if not lines:
        return ""
    limits = (-0.02, 1.02) if "share" in figure else None
    across = Axis(sweep.x, log=sweep.log, ticks=tuple(sweep.points) if sweep.log else ())
    return line_chart(lines, across, Axis(figure, limits, sweep.log), size=SMALL, name=f"{sweep.title}: {figure}")


def interval(values: Sequence[float]) -> tuple[float, float, float]:
    """(mean, low, high) of a figure over the seeds: Wilson's where each says yes or no, else Student's t.

    A single value of the other kind has no band.
    """
    if all(isinstance(value, bool) for value in values):
        yes = int(sum(values))
        return (yes / len(values), *wilson(yes, len(values)))
    if len(values) == 1:
        return values[0], values[0], values[0]
    mean, low, high = map(float, mean_interval(np.array(values)))
    return mean, low, high


def growth_charts(result: GrowthResult) -> list[str]:
    """RMSE and Neff against N, and RMSE against Np / N."""
    style = styles(result.by_particles)
    n = np.array(PARTICLES, dtype=np.float64)

    def line(label: str, figure: Callable[[Filtering, int], Floats]) -> Line:
        every = result.by_particles[label].items()
        middle, low, high = np.array([mean_interval(figure(each, count)) for count, each in every]).T
        return Line(style[label], n, middle, low, high)

    rmse = [line(label, lambda each, count: each.rmse) for label in result.by_particles]
    neff = [line(label, lambda each, count: each.neff / count) for label in result.by_particles]
    shares = np.array(list(result.by_share))
    middle, low, high = np.array([mean_interval(each.rmse) for each in result.by_share.values()]).T
    return [
        line_chart(rmse, Axis("N"), Axis("RMSE"), size=SMALL, name="growth model: RMSE against N"),
        line_chart(neff, Axis("N"), Axis("Neff / N", (0, 1)), size=SMALL, name="growth model: Neff against N"),
        line_chart(
            [Line(style["WSPF"], shares, middle, low, high)],
            Axis("Np / N, at N = 100"),
            Axis("RMSE"),
            size=SMALL,
            name="growth model: RMSE against Np",
        ),
    ]
