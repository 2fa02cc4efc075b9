"""Running what the papers' experiments want: every scene once a seed, all its trackers over it together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from irsim.types import Source
from irtrack.bench import Entry, Results, RunRecord, parse_tracker_spec, run_bench
from irtrack.errors import InputError
from irtrack.papers.values import Paper, Run, Scene

FIRST_SEED = 2000
"""The page's first seed: seeds below it were used while the trackers were made."""

DEVELOPMENT = range(1000, 1020)
"""Seeds on which whatever is picked is picked: trackers and variants were made on these as well."""

Progress = Callable[[str, int, int], None]
"""Called with (scene, runs done, runs to do)."""


@dataclass
class Wanted:
    """Trackers by label on each scene, by the scene's name."""

    scenes: dict[str, Scene] = field(default_factory=dict)
    trackers: dict[str, dict[str, str]] = field(default_factory=dict)

    def add(self, scene: Scene, trackers: Mapping[str, str]) -> None:
        self.scenes[scene.name] = scene
        self.trackers.setdefault(scene.name, {}).update(trackers)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The runs of a scene: by label, then by seed; None where a run failed. absent: trackers that are not here, why."""

    source: Source
    runs: Mapping[str, Mapping[int, Run | None]]
    absent: Mapping[str, str]

    def of(self, label: str) -> dict[int, Run]:
        """The runs of a tracker that did not fail, by seed."""
        return {seed: run for seed, run in self.runs.get(label, {}).items() if run is not None}

    def failed(self, label: str) -> int:
        return sum(run is None for run in self.runs.get(label, {}).values())

    def off_shares(self, label: str) -> dict[int, float]:
        """Share of frames off of each seed; a failed run was off throughout."""
        shares = {}
        for seed, run in self.runs.get(label, {}).items():
            if run is None:
                shares[seed] = 1.0
            elif run.score.off_share is not None:
                shares[seed] = run.score.off_share
        return shares


def wanted(papers: Iterable[Paper]) -> Wanted:
    """All that the papers' experiments, sweeps and switches need."""
    found = Wanted()
    for paper in papers:
        for experiment in paper.experiments:
            for scene in (experiment.scene, *experiment.siblings):
                found.add(scene, experiment.trackers)
        for sweep in paper.sweeps:
            for scene, trackers in sweep.points.values():
                found.add(scene, {spec: spec for spec in trackers.values()})
        for switch in paper.switches:
            found.add(switch.scene, {spec: spec for spec in (switch.with_it, switch.without)})
    return found


def outcomes(
    needed: Wanted, results: Path, seeds: Sequence[int], jobs: int, progress: Progress | None = None
) -> dict[str, Outcome]:
    """The outcome of each scene, by its name; what the results file has is not run again.

    progress is told of the runs of all scenes together.
    """
    counts = {name: len(trackers) * len(seeds) for name, trackers in needed.trackers.items()}
    total, before = sum(counts.values()), 0
    found = {}
    for name, scene in needed.scenes.items():
        told = None if progress is None else partial(_tell, progress, name, before + counts[name], total)
        found[name] = outcome(scene.open(), needed.trackers[name], results, seeds, jobs, told)
        before += counts[name]
    return found


def _tell(progress: Progress, scene: str, after: int, total: int, done: int, to_do: int) -> None:
    """Of a scene after which `after` runs of the `total` are done, `done` of the `to_do` that were missing are done."""
    progress(scene, after - to_do + done, total)


def outcome(
    source: Source,
    trackers: Mapping[str, str],
    results: Path,
    seeds: Sequence[int],
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> Outcome:
    """The runs of trackers, by label, on one source."""
    entries, absent = present(trackers)
    if not entries:
        return Outcome(source, {}, absent)
    kept = run_bench([source], entries, results=results, seeds=seeds, jobs=jobs, progress=progress)
    runs: dict[str, dict[int, Run | None]] = {entry.label: {} for entry in entries}
    with kept:
        for cell in kept.cells(run=kept.run):
            runs[cell.label][cell.key.tracker_seed] = _run(kept, cell)
    return Outcome(source, runs, absent)


def present(trackers: Mapping[str, str]) -> tuple[list[Entry], dict[str, str]]:
    """The trackers that are here, and why others are not."""
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
