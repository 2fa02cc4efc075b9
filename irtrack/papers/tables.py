"""What the page says of an experiment: a row for each tracker, the printed figures beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtrack.metrics import CentreFigures, wilson
from irtrack.papers.ours import is_peer
from irtrack.papers.rules import cpu, wall
from irtrack.papers.runs import Outcome
from irtrack.papers.values import Experiment, Paper, Printed, Run

UNPRINTED = Printed()


@dataclass(frozen=True)
class Row:
    """One tracker on one scene.

    lost of told runs, low .. high the interval of that share
    held, all     centre errors of the frames before the loss, and of all scored frames, all runs together
    kept          the same of all frames of those runs that are not lost
    ms            median CPU time of a step; of a peer, which is another process, wall time
    siblings      (lost, told) on each of the experiment's siblings
    absent        why there is nothing, where there is nothing
    """

    label: str
    spec: str
    runs: int = 0
    failed: int = 0
    lost: int = 0
    told: int = 0
    low: float = 0.0
    high: float = 1.0
    kept: CentreFigures | None = None
    kept_frames: int = 0
    all: CentreFigures | None = None
    all_frames: int = 0
    off: float | None = None
    ms: float | None = None
    siblings: tuple[tuple[int, int], ...] = ()
    printed: Printed = UNPRINTED
    absent: str = ""

    @property
    def share(self) -> float | None:
        return self.lost / self.told if self.told else None


def rows(experiment: Experiment, every: Mapping[str, Outcome]) -> list[Row]:
    """A row for each tracker, in the experiment's order; `every`: the outcomes by scene."""
    found = every[experiment.scene.name]
    siblings = [every[scene.name] for scene in experiment.siblings]
    printed = experiment.printed
    return [
        replace(
            row(label, spec, printed.get(label, UNPRINTED), found),
            siblings=tuple(losses(label, sibling) for sibling in siblings),
        )
        for label, spec in experiment.trackers.items()
    ]


def losses(label: str, found: Outcome) -> tuple[int, int]:
    """(lost, told) of a tracker's runs."""
    told = [run.score.lost for run in found.of(label).values() if run.score.lost is not None]
    return sum(told), len(told)


def row(label: str, spec: str, printed: Printed, found: Outcome) -> Row:
    """What came out of a tracker on a scene."""
    if label not in found.runs:
        return Row(label, spec, printed=printed, absent=found.absent.get(label, "was not run"))
    runs = list(found.of(label).values())
    lost, told = losses(label, found)
    kept = [run for run in runs if not run.score.lost]
    low, high = wilson(lost, told)
    of = wall if is_peer(spec) else cpu
    steps = [took for run in runs if (took := of(run)) is not None]
    off = [run.score.off_share for run in runs if run.score.off_share is not None]
    kept_figures, kept_frames = errors(kept)
    all_figures, all_frames = errors(runs)
    return Row(
        label,
        spec,
        runs=len(runs) + found.failed(label),
        failed=found.failed(label),
        lost=lost,
        told=told,
        low=low,
        high=high,
        kept=kept_figures,
        kept_frames=kept_frames,
        all=all_figures,
        all_frames=all_frames,
        off=float(np.mean(off)) if off else None,
        ms=float(np.median(steps)) if steps else None,
        printed=printed,
    )


def errors(runs: Sequence[Run]) -> tuple[CentreFigures | None, int]:
    """The centre errors of all scored frames of the runs taken together, and how many frames these are."""
    if not runs:
        return None, 0
    offsets = np.concatenate([run.trace.offsets[run.trace.scored] for run in runs])
    return CentreFigures.of(offsets), len(offsets)


@dataclass(frozen=True)
class Speed:
    """Frames a second of a tracker, as printed and here."""

    paper: str
    scene: str
    label: str
    then: float
    now: float | None


def speeds(paper: Paper, outcomes: Mapping[str, Outcome]) -> list[Speed]:
    """Of every tracker whose time the paper prints."""
    found = []
    for experiment in paper.experiments:
        for each in rows(experiment, outcomes):
            if each.printed.ms is not None:
                now = None if each.ms is None else 1000 / each.ms
                found.append(Speed(paper.title, experiment.scene.name, each.label, 1000 / each.printed.ms, now))
    return found
