"""Rows and charts of the page: a row for each tracker, the printed figures beside ours."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irsim.types import Floats
from irtrack.external import PEERS
from irtrack.metrics import CentreFigures, mean_interval, wilson
from irtrack.papers.experiment import Experiment, Figure, Paper, Printed, Run, Sweep
from irtrack.papers.growth import PARTICLES, FilterRuns, GrowthResult
from irtrack.papers.rules import bounded_error, cpu, off_share, wall
from irtrack.papers.runs import SceneRuns
from irtrack.report.line_styles import LineStyle, styles
from irtrack.report.plots import Axis, Line, error_chart, line_chart

SMALL = (450, 280)
UNPRINTED = Printed()


@dataclass(frozen=True)
class Row:
    """Row of one tracker on one scene.

    lost, decided   numbers of runs with track loss, and of runs in which loss is defined; low .. high: interval of
                    their ratio
    kept, all       centre errors of all frames of the runs without loss, and of all runs
    off             mean share of frames off target
    bounded         mean bounded error of all runs, px
    ms              median CPU time of a step; of an external tracker, wall time
    siblings        (lost, decided) on each of the experiment's siblings
    absent          reason where the tracker has no runs
    """

    label: str
    spec: str
    siblings: tuple[tuple[int, int], ...]
    printed: Printed
    absent: str = ""
    runs: int = 0
    failed: int = 0
    lost: int = 0
    decided: int = 0
    kept: CentreFigures | None = None
    all: CentreFigures | None = None
    off: float | None = None
    bounded: float | None = None
    ms: float | None = None

    @property
    def share(self) -> float | None:
        return self.lost / self.decided if self.decided else None

    @property
    def low(self) -> float:
        return wilson(self.lost, self.decided)[0]

    @property
    def high(self) -> float:
        return wilson(self.lost, self.decided)[1]


def rows(experiment: Experiment, every: Mapping[str, SceneRuns]) -> list[Row]:
    """Return a row for each tracker, in the experiment's order; `every`: the runs by scene."""
    return [_row(experiment, label, spec, every) for label, spec in experiment.trackers.items()]


def _row(experiment: Experiment, label: str, spec: str, every: Mapping[str, SceneRuns]) -> Row:
    found = every[experiment.scene.name]
    siblings = tuple(_losses(label, every[scene.name]) for scene in experiment.siblings)
    printed = experiment.printed.get(label, UNPRINTED)
    if label not in found.runs:
        return Row(label, spec, siblings, printed, found.reason(label))
    runs = list(found.of(label).values())
    lost, decided = _losses(label, found)
    steps = _values(wall if spec.partition(":")[0] in PEERS else cpu, runs)
    off, bounded = _values(off_share, runs), _values(bounded_error, runs)
    return Row(
        label,
        spec,
        siblings,
        printed,
        runs=len(found.runs[label]),
        failed=len(found.runs[label]) - len(runs),
        lost=lost,
        decided=decided,
        kept=_errors([run for run in runs if not run.score.lost]),
        all=_errors(runs),
        off=float(np.mean(off)) if off else None,
        bounded=float(np.mean(bounded)) if bounded else None,
        ms=float(np.median(steps)) if steps else None,
    )


def _values(figure: Figure, runs: Iterable[Run]) -> list[float]:
    """Return the values of a metric, of the runs for which it is defined."""
    return [value for run in runs if (value := figure.of(run)) is not None]


def _losses(label: str, found: SceneRuns) -> tuple[int, int]:
    """Return the numbers of lost runs and of runs in which loss is defined."""
    decided = [run.score.lost for run in found.of(label).values() if run.score.lost is not None]
    return sum(decided), len(decided)


def _errors(runs: Sequence[Run]) -> CentreFigures | None:
    """Return the centre errors of all scored frames of the runs together."""
    return CentreFigures.of(np.concatenate([run.trace.offsets[run.trace.scored] for run in runs])) if runs else None


@dataclass(frozen=True)
class Speed:
    """Frames per second of a tracker, as printed in the paper and as measured here."""

    paper: str
    scene: str
    label: str
    then: float
    now: float | None


def speeds(paper: Paper, every: Mapping[str, SceneRuns]) -> list[Speed]:
    """Return the speed of each tracker whose time the paper prints."""
    return [
        Speed(paper.title, part.scene.name, row.label, 1000 / row.printed.ms, row.ms and 1000 / row.ms)
        for part in paper.experiments
        for row in rows(part, every)
        if row.printed.ms is not None
    ]


def error_over_frames(experiment: Experiment, found: SceneRuns, style: Mapping[str, LineStyle]) -> str:
    """Draw the centre error over frames, median and quartiles over the seeds; '' without runs."""
    traces = {label: [run.trace for run in found.of(label).values()] for label in style}
    shown = {label: seeds for label, seeds in traces.items() if seeds}
    every = [trace for seeds in shown.values() for trace in seeds]
    return error_chart(shown, every, style, experiment.scene.name) if every else ""


def scores_over_frames(label: str, found: SceneRuns, style: LineStyle) -> str:
    """Draw the tracker's own score over frames, median and quartiles over the seeds; '' where it has none."""
    runs = list(found.of(label).values())
    if not runs or not all(np.isfinite(run.trace.scores[1:]).all() for run in runs):
        return ""
    low, middle, high = np.percentile([run.trace.scores[1:] for run in runs], (25, 50, 75), axis=0)
    name = f"{found.source.name}: matching coefficient of {label}"
    line = Line(style, runs[0].trace.indices[1:], middle, low, high)
    return line_chart([line], Axis("frame"), Axis("matching coefficient", (0, 1)), size=(900, 220), name=name)


def sweep_chart(
    sweep: Sweep, words: str, figure: Figure, every: Mapping[str, SceneRuns], style: Mapping[str, LineStyle]
) -> str:
    """Draw the mean of a metric over the seeds against the setting, with its 95 % interval; '' without runs."""
    lines = []
    for label in sweep.labels:
        points = []
        for x, (scene, specs) in sweep.points.items():
            if values := _values(figure, every[scene.name].of(specs[label]).values()):
                points.append((x, *interval(values)))
        if points:
            lines.append(Line(style[label], *np.array(points).T))
    if not lines:
        return ""
    limits = (-0.02, 1.02) if "share" in words else None
    across = Axis(sweep.x, log=sweep.log, ticks=tuple(sweep.points) if sweep.log else ())
    return line_chart(lines, across, Axis(words, limits, sweep.log), size=SMALL, name=f"{sweep.title}: {words}")


def interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Return (mean, low, high) over the seeds: Wilson's interval for true and false, Student's t for numbers.

    A single number has no interval.
    """
    if all(isinstance(value, bool) for value in values):
        yes = int(sum(values))
        return (yes / len(values), *wilson(yes, len(values)))
    if len(values) == 1:
        return values[0], values[0], values[0]
    mean, low, high = map(float, mean_interval(np.array(values)))
    return mean, low, high


def growth_charts(result: GrowthResult) -> list[str]:
    """Draw RMSE and Neff against N, and RMSE against Np / N."""
    style = styles(result.by_particles)

    def line(label: str, figure: Callable[[FilterRuns, int], Floats]) -> Line:
        every = result.by_particles[label].items()
        points = np.array([mean_interval(figure(each, count)) for count, each in every])
        return Line(style[label], np.array(PARTICLES, dtype=np.float64), *points.T)

    rmse = [line(label, lambda each, count: each.rmse) for label in result.by_particles]
    neff = [line(label, lambda each, count: each.neff / count) for label in result.by_particles]
    shares = np.array([mean_interval(each.rmse) for each in result.by_share.values()]).T
    share = Line(style["WSPF, own weights"], np.array(list(result.by_share)), *shares)
    return [
        line_chart(rmse, Axis("N"), Axis("RMSE"), size=SMALL, name="growth model: RMSE against N"),
        line_chart(neff, Axis("N"), Axis("Neff / N", (0, 1)), size=SMALL, name="growth model: Neff against N"),
        line_chart([share], Axis("Np / N, at N = 100"), Axis("RMSE"), size=SMALL, name="growth model: RMSE against Np"),
    ]
