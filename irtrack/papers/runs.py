"""Runs of the papers' trackers on their scenes; choices on development seeds; runs on real recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

import irsim
from irsim.types import Source
from irtrack.bench import Entry, Results, RunRecord, parse_tracker_spec, run_bench
from irtrack.errors import InputError
from irtrack.metrics import Trace
from irtrack.papers.experiment import HARD, OURS, THEIRS, Choice, Paper, Run, Scene, Switch

FIRST_SEED = 2000
"""First seed of the page. Seeds below it were used while the trackers were developed."""
DEVELOPMENT = range(1000, 1020)
"""Seeds on which trackers and settings are chosen; disjoint from those of the page."""
REAL_SEEDS = 20
"""Tracker seeds on real recordings."""
LABELS = "gt.csv"

Progress = Callable[[str, int, int], None]
"""Called with (scene, runs done, runs to do)."""


@dataclass
class RunPlan:
    """Scenes by name, and the tracker specs by label to run on each."""

    scenes: dict[str, Scene] = field(default_factory=dict)
    trackers: dict[str, dict[str, str]] = field(default_factory=dict)

    def add(self, scene: Scene, trackers: Mapping[str, str]) -> None:
        self.scenes[scene.name] = scene
        self.trackers.setdefault(scene.name, {}).update(trackers)


def plan_papers(papers: Iterable[Paper]) -> RunPlan:
    """Return all runs of the papers' experiments, sweeps and switches."""
    plan = RunPlan()
    for paper in papers:
        for experiment in paper.experiments:
            for scene in (experiment.scene, *experiment.siblings):
                plan.add(scene, experiment.trackers)
        for sweep in paper.sweeps:
            for scene, trackers in sweep.points.values():
                plan.add(scene, {spec: spec for spec in trackers.values()})
        for switch in paper.switches:
            plan.add(switch.scene, {spec: spec for spec in (switch.with_it, switch.without)})
    return plan


def plan_choices(papers: Iterable[Paper]) -> RunPlan:
    """Return the development runs on which the papers' rivals are chosen."""
    plan = RunPlan()
    for choice in (rival.without for paper in papers for rival in paper.rivals):
        for scene in choice.scenes:
            plan.add(scene, {spec: spec for spec in choice.specs})
    return plan


def plan_hard(trackers: Mapping[str, str]) -> RunPlan:
    """Return the runs of trackers, by label, on every hard scene."""
    plan = RunPlan()
    for experiment in HARD:
        plan.add(experiment.scene, trackers)
    return plan


@dataclass(frozen=True, eq=False)
class SceneRuns:
    """Runs on a scene by label and seed, None where a run failed; absent: reasons by label of trackers not found."""

    source: Source
    runs: Mapping[str, Mapping[int, Run | None]]
    absent: Mapping[str, str]

    def of(self, label: str) -> dict[int, Run]:
        """Return the runs of a tracker that did not fail, by seed."""
        return {seed: run for seed, run in self.runs.get(label, {}).items() if run is not None}

    def failed(self, label: str) -> int:
        return sum(run is None for run in self.runs.get(label, {}).values())

    def reason(self, label: str) -> str:
        """Return the reason why a tracker has no runs."""
        return self.absent.get(label, f"{label} was not run")

    def off_shares(self, label: str) -> dict[int, float]:
        """Return the share of frames off by seed; 1 for a failed run."""
        shares = {}
        for seed, run in self.runs.get(label, {}).items():
            if run is None:
                shares[seed] = 1.0
            elif run.score.off_share is not None:
                shares[seed] = run.score.off_share
        return shares


def run_plan(
    plan: RunPlan, results: Path, seeds: Sequence[int], jobs: int, progress: Progress | None = None
) -> dict[str, SceneRuns]:
    """Return the runs of each scene by its name. Runs that the results file has are not repeated.

    progress counts the runs of all scenes together.
    """
    counts = {name: len(trackers) * len(seeds) for name, trackers in plan.trackers.items()}
    total, before = sum(counts.values()), 0
    found = {}
    for name, scene in plan.scenes.items():
        scene_progress = None if progress is None else partial(_advance, progress, name, before + counts[name], total)
        found[name] = run_scene(scene.open(), plan.trackers[name], results, seeds, jobs, scene_progress)
        before += counts[name]
    return found


def _advance(progress: Progress, scene: str, after: int, total: int, done: int, to_do: int) -> None:
    """Report progress in a scene that ends after `after` of `total` runs; `done` of its `to_do` missing ones done."""
    progress(scene, after - to_do + done, total)


def run_scene(
    source: Source,
    trackers: Mapping[str, str],
    results: Path,
    seeds: Sequence[int],
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> SceneRuns:
    """Return the runs of trackers, by label, on one source."""
    entries, absent = available(trackers)
    if not entries:
        return SceneRuns(source, {}, absent)
    kept = run_bench([source], entries, results=results, seeds=seeds, jobs=jobs, progress=progress)
    runs: dict[str, dict[int, Run | None]] = {entry.label: {} for entry in entries}
    with kept:
        for cell in kept.cells(run=kept.run):
            runs[cell.label][cell.key.tracker_seed] = _run(kept, cell)
    return SceneRuns(source, runs, absent)


def available(trackers: Mapping[str, str]) -> tuple[list[Entry], dict[str, str]]:
    """Return the trackers that can run, and for the others the reason by label."""
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
    """Return the tracker with the smallest mean share of frames off, of equal ones the first; None without runs."""
    means = {}
    for label in labels:
        shares = [share for each in found for share in each.off_shares(label).values()]
        if shares:
            means[label] = sum(shares) / len(shares)
    return min(means, key=lambda label: means[label]) if means else None


def choose(choice: Choice, development: Mapping[str, SceneRuns]) -> str:
    """Return the spec with the fewest frames off over the scenes."""
    return fewest_off(choice.specs, [development[scene.name] for scene in choice.scenes]) or choice.specs[0]


def settle_rivals(paper: Paper, development: Mapping[str, SceneRuns]) -> Paper:
    """Return the paper with a switch in place of each rival, chosen by the runs of development seeds."""
    switches = (
        Switch(rival.mechanism, rival.scene, rival.with_it, choose(rival.without, development))
        for rival in paper.rivals
    )
    return replace(paper, switches=(*paper.switches, *switches), rivals=())


@dataclass(frozen=True)
class RealRow:
    """One tracker on one real sequence, all targets and seeds: runs, losses, median centre distance in px."""

    sequence: str
    label: str
    targets: int
    seeds: int
    runs: int
    failed: int
    lost: int
    distance: float | None
    within: float | None


RealRuns = dict[str, list[tuple[RunRecord, Trace | None]]]
"""Run records and their traces by the tracker's label."""


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

    A tracker with the same outcome for two seeds draws no random numbers; it runs once.
    """
    entries, _ = available(OURS | THEIRS)
    rows = []
    for sequence in real_sequences(folder):
        recording = work / f"{sequence.name}.mcap"
        if not recording.exists():
            irsim.import_frames(sequence / "frames.mp4", recording, truth=sequence / LABELS)
        source = irsim.open_recording(recording)
        targets = sorted({target.id for truth in source.truths() for target in truth.targets})
        twice = _run_targets(source, targets, entries, results, jobs, min(seeds, 2), progress)
        steady = [label for label, runs in twice.items() if _is_deterministic(runs)]
        drawing = [entry for entry in entries if entry.label not in steady]
        found = {label: [run for run in twice[label] if run[0].key.tracker_seed == 0] for label in steady}
        found |= _run_targets(source, targets, drawing, results, jobs, seeds, progress)
        rows += [_real_row(sequence.name, label, len(targets), runs) for label, runs in found.items()]
    return sorted(rows, key=lambda row: (row.sequence, row.lost / row.runs, row.distance or np.inf))


def _run_targets(
    source: irsim.Source,
    targets: Sequence[str],
    entries: Sequence[Entry],
    results: Path,
    jobs: int,
    seeds: int,
    progress: Progress | None,
) -> RealRuns:
    """Run the trackers on each labelled target from its first frame."""
    found: RealRuns = {entry.label: [] for entry in entries}
    for target in targets if entries else ():
        advance = None if progress is None else partial(progress, f"{source.name}, {target}")
        kept = run_bench([source], entries, results=results, seeds=seeds, jobs=jobs, target=target, progress=advance)
        with kept:
            for cell in kept.cells(run=kept.run):
                found[cell.label].append((cell, kept.trace(cell.key)))
    return found


def _is_deterministic(runs: Sequence[tuple[RunRecord, Trace | None]]) -> bool:
    """Return whether all seeds of each target have the same outcome."""
    outcomes: dict[str | None, set[str | None]] = {}
    for cell, _ in runs:
        outcomes.setdefault(cell.key.target, set()).add(cell.outcome)
    return all(len(each) == 1 for each in outcomes.values())


def _real_row(sequence: str, label: str, targets: int, runs: Sequence[tuple[RunRecord, Trace | None]]) -> RealRow:
    """Return a row. A failed run counts as lost and has no distance."""
    errors = [trace.errors[trace.scored] for _, trace in runs if trace is not None]
    distances = np.concatenate(errors) if errors else np.array([])
    return RealRow(
        sequence=sequence,
        label=label,
        targets=targets,
        seeds=len(runs) // targets,
        runs=len(runs),
        failed=sum(cell.score is None for cell, _ in runs),
        lost=sum(cell.lost_or_failed for cell, _ in runs),
        distance=float(np.median(distances)) if len(distances) else None,
        within=float(np.mean(distances <= 20)) if len(distances) else None,
    )
