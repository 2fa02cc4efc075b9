"""Runs of the papers' trackers on their scenes; choices on development seeds; runs on real recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np

import irsim
from irsim.types import Source
from irtrack.bench import Entry, Results, RunRecord, parse_tracker_spec, run_bench
from irtrack.errors import InputError
from irtrack.papers.experiment import HARD, OURS, THEIRS, Choice, Paper, Run, Scene

FIRST_SEED = 2000
"""First seed of the page; seeds below it were used while the trackers were developed."""
DEVELOPMENT = range(1000, 1020)
"""Seeds on which trackers and settings are chosen."""
REAL_SEEDS = 20
"""Tracker seeds on real recordings."""
LABELS = "gt.csv"

RunPlan = dict[Scene, dict[str, str]]
"""Tracker specs, by label, to run on each scene."""


class Progress(Protocol):
    """Function that takes the runs done and to do on one scene, and a note that names it."""

    def __call__(self, done: int, total: int | None = None, note: str = "") -> None: ...


def _planned(parts: Iterable[tuple[Scene, Mapping[str, str]]]) -> RunPlan:
    plan: RunPlan = {}
    for scene, trackers in parts:
        plan.setdefault(scene, {}).update(trackers)
    return plan


def _by_spec(specs: Iterable[str]) -> dict[str, str]:
    return {spec: spec for spec in specs}


def plan_paper(paper: Paper) -> RunPlan:
    """Return all runs of the experiments, sweeps and ablations."""
    pairs = [(scene, each.trackers) for each in paper.experiments for scene in (each.scene, *each.siblings)]
    pairs += [(scene, _by_spec(specs.values())) for each in paper.sweeps for scene, specs in each.points.values()]
    sides = [(each.scene, (each.with_it, each.without)) for each in paper.switches]
    pairs += [(scene, _by_spec(side for side in both if isinstance(side, str))) for scene, both in sides]
    return _planned(pairs)


def plan_choices(papers: Iterable[Paper]) -> RunPlan:
    """Return the development runs that decide the choices of ablations (`Switch`)."""
    choices = (each.without for paper in papers for each in paper.switches if isinstance(each.without, Choice))
    return _planned((scene, _by_spec(choice.specs)) for choice in choices for scene in choice.scenes)


def plan_hard(trackers: Mapping[str, str]) -> RunPlan:
    """Return the runs of trackers, by label, on every hard scene."""
    return _planned((experiment.scene, trackers) for experiment in HARD)


@dataclass(frozen=True, eq=False)
class SceneRuns:
    """Runs on a scene by label and seed, None where a run failed; `absent`: why a tracker has no runs, by label."""

    source: Source
    runs: Mapping[str, Mapping[int, Run | None]]
    absent: Mapping[str, str]

    def of(self, label: str) -> dict[int, Run]:
        """Return the runs of a tracker that did not fail, by seed."""
        return {seed: run for seed, run in self.runs.get(label, {}).items() if run is not None}

    def reason(self, label: str) -> str:
        """Return the reason why a tracker has no runs."""
        return self.absent.get(label, f"{label} was not run")

    def off_shares(self, label: str) -> dict[int, float]:
        """Return the share of frames off target by seed; 1 for a failed run."""
        runs = self.runs.get(label, {}).items()
        shares = {seed: 1.0 if run is None else run.score.off_share for seed, run in runs}
        return {seed: share for seed, share in shares.items() if share is not None}


def run_plan(
    plan: RunPlan, results: Path, seeds: Sequence[int], jobs: int, progress: Progress | None = None
) -> dict[str, SceneRuns]:
    """Return the runs of each scene by its name. Runs that the results file has are not repeated."""
    found = {}
    for number, (scene, trackers) in enumerate(plan.items(), 1):
        note = f"{scene.name}, scene {number} of {len(plan)}"
        found[scene.name] = run_scene(scene.open(), trackers, results, seeds, jobs, progress, note)
    return found


def run_scene(
    source: Source,
    trackers: Mapping[str, str],
    results: Path,
    seeds: Sequence[int],
    jobs: int,
    progress: Progress | None = None,
    note: str = "",
    target: str | None = None,
) -> SceneRuns:
    """Return the runs of trackers, by label, on one source."""
    entries, absent = available(trackers)
    if not entries:
        return SceneRuns(source, {}, absent)
    runs: dict[str, dict[int, Run | None]] = {entry.label: {} for entry in entries}
    advance = None if progress is None else partial(progress, note=note)
    with run_bench([source], entries, results=results, seeds=seeds, jobs=jobs, target=target, progress=advance) as kept:
        for cell in kept.cells(run=kept.run):
            runs[cell.label][cell.key.tracker_seed] = _run(kept, cell)
    return SceneRuns(source, runs, absent)


def available(trackers: Mapping[str, str]) -> tuple[list[Entry], dict[str, str]]:
    """Return the trackers that can run, and by label the reasons why others cannot."""
    entries, absent = [], {}
    for label, spec in trackers.items():
        try:
            entries.append(Entry(label, parse_tracker_spec(spec).tracker))
        except InputError as error:
            absent[label] = str(error)
    return entries, absent


def _run(kept: Results, cell: RunRecord) -> Run | None:
    trace = kept.trace(cell.key)
    return None if cell.score is None or trace is None else Run(cell.score, trace)


def fewest_off(labels: Iterable[str], found: Sequence[SceneRuns]) -> str | None:
    """Return the label with the smallest mean share of frames off target; the first of a tie; None without runs."""
    shares = {label: [share for each in found for share in each.off_shares(label).values()] for label in labels}
    means = {label: sum(each) / len(each) for label, each in shares.items() if each}
    return min(means, key=lambda label: means[label]) if means else None


def settle_choices(paper: Paper, development: Mapping[str, SceneRuns]) -> Paper:
    """Return the paper with the spec chosen by the development runs in place of each choice."""

    def settled(side: str | Choice) -> str:
        if isinstance(side, str):
            return side
        return fewest_off(side.specs, [development[scene.name] for scene in side.scenes]) or side.specs[0]

    return replace(paper, switches=tuple(replace(switch, without=settled(switch.without)) for switch in paper.switches))


@dataclass(frozen=True)
class RealRow:
    """Row of one tracker on one real sequence, over all targets and seeds: runs, losses, median centre error, px."""

    sequence: str
    label: str
    targets: int
    seeds: int
    runs: int
    failed: int
    lost: int
    distance: float | None
    within: float | None


def real_sequences(folder: Path) -> list[Path]:
    """Return the sub-folders with a video and its labels; InputError where there is none."""
    found = sorted(path.parent for path in folder.glob(f"*/{LABELS}") if path.with_name("frames.mp4").is_file())
    if not found:
        raise InputError(f"{folder}: holds no sequence; allowed: a folder of folders with frames.mp4 and {LABELS}")
    return found


def run_real(
    folder: Path, work: Path, results: Path, jobs: int, seeds: int = REAL_SEEDS, progress: Progress | None = None
) -> list[RealRow]:
    """Return a row for each tracker on each sequence. `work` is a temporary folder for the imported recordings.

    A tracker with the same track for all seeds draws no random numbers: its run counts once.
    """
    rows = []
    for sequence in real_sequences(folder):
        recording = work / f"{sequence.name}.mcap"
        if not recording.exists():
            irsim.import_frames(sequence / "frames.mp4", recording, truth=sequence / LABELS)
        source = irsim.open_recording(recording)
        targets = sorted({target.id for truth in source.truths() for target in truth.targets})
        found = []
        for target in targets:
            note = f"{source.name}, {target}"
            found.append(run_scene(source, OURS | THEIRS, results, range(seeds), jobs, progress, note, target))
        for label in found[0].runs:
            rows.append(_real_row(sequence.name, label, [_distinct(each.runs[label].values()) for each in found]))
    return sorted(rows, key=lambda row: (row.sequence, row.lost / row.runs, row.distance or np.inf))


def _distinct(runs: Iterable[Run | None]) -> list[Run | None]:
    """Return the runs of all seeds, or one of them where the tracker has the same track with every seed."""
    every = list(runs)
    return every[:1] if len({run and run.trace.digest for run in every}) == 1 else every


def _real_row(sequence: str, label: str, by_target: Sequence[Sequence[Run | None]]) -> RealRow:
    """Return a row. A failed run counts as lost and has no distance."""
    runs = [run for each in by_target for run in each]
    errors = [run.trace.errors[run.trace.scored] for run in runs if run is not None]
    distances = np.concatenate(errors) if errors else np.array([])
    return RealRow(
        sequence=sequence,
        label=label,
        targets=len(by_target),
        seeds=len(runs) // len(by_target),
        runs=len(runs),
        failed=runs.count(None),
        lost=sum(run is None or run.score.lost is True for run in runs),
        distance=float(np.median(distances)) if len(distances) else None,
        within=float(np.mean(distances <= 20)) if len(distances) else None,
    )
