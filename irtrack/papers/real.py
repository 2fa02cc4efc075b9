"""Recordings of real cameras with loose labels: all trackers and peers, every labelled target from its first frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import irsim
from irtrack.bench import Entry, RunRecord, run_bench
from irtrack.errors import InputError
from irtrack.metrics import Trace
from irtrack.papers.ours import OURS, THEIRS
from irtrack.papers.runs import Progress, present

TRACKER_SEEDS = 20
LABELS = "gt.csv"


@dataclass(frozen=True)
class RealRow:
    """One tracker on one sequence, all targets and seeds together: median centre distance, px, and loss."""

    sequence: str
    label: str
    targets: int
    seeds: int
    runs: int
    failed: int
    lost: int
    distance: float | None
    within: float | None


Found = dict[str, list[tuple[RunRecord, Trace | None]]]
"""Cells and their traces by the tracker's label."""


def sequences(folder: Path) -> list[Path]:
    """The sequences in a folder: sub-folders with a video and its labels. InputError where there is none."""
    found = sorted(path.parent for path in folder.glob(f"*/{LABELS}") if path.with_name("frames.mp4").is_file())
    if not found:
        raise InputError(f"{folder}: holds no sequence; allowed: a folder of folders with frames.mp4 and {LABELS}")
    return found


def real_rows(
    folder: Path,
    work: Path,
    results: Path,
    jobs: int,
    seeds: int = TRACKER_SEEDS,
    progress: Progress | None = None,
) -> list[RealRow]:
    """A row for each tracker on each sequence. Recordings are made in `work`, which must not be kept with the page.

    A tracker that does the same with two seeds draws no random numbers and counts once.
    """
    entries, _ = present(OURS | THEIRS)
    rows = []
    for sequence in sequences(folder):
        recording = work / f"{sequence.name}.mcap"
        if not recording.exists():
            irsim.import_frames(sequence / "frames.mp4", recording, truth=sequence / LABELS)
        source = irsim.open_recording(recording)
        targets = sorted({target.id for truth in source.truths() for target in truth.targets})
        twice = _cells(source, targets, entries, results, jobs, min(seeds, 2), progress)
        steady = [label for label, found in twice.items() if _is_steady(found)]
        drawing = [entry for entry in entries if entry.label not in steady]
        found = {label: [one for one in twice[label] if one[0].key.tracker_seed == 0] for label in steady}
        found |= _cells(source, targets, drawing, results, jobs, seeds, progress)
        rows += [_row(sequence.name, label, len(targets), each) for label, each in found.items()]
    return sorted(rows, key=lambda row: (row.sequence, row.lost / row.runs, row.distance or np.inf))


def _cells(
    source: irsim.Source,
    targets: Sequence[str],
    entries: Sequence[Entry],
    results: Path,
    jobs: int,
    seeds: int,
    progress: Progress | None,
) -> Found:
    found: Found = {entry.label: [] for entry in entries}
    if not entries:
        return found
    for target in targets:
        tell = None if progress is None else partial(progress, f"{source.name}, {target}")
        kept = run_bench([source], entries, results=results, seeds=seeds, jobs=jobs, target=target, progress=tell)
        with kept:
            for cell in kept.cells(run=kept.run):
                found[cell.label].append((cell, kept.trace(cell.key)))
    return found


def _is_steady(found: Sequence[tuple[RunRecord, Trace | None]]) -> bool:
    """Whether each target's runs came to the same, whatever the seed."""
    outcomes: dict[str | None, set[str | None]] = {}
    for cell, _ in found:
        outcomes.setdefault(cell.key.target, set()).add(cell.outcome)
    return all(len(each) == 1 for each in outcomes.values())


def _row(sequence: str, label: str, targets: int, found: Sequence[tuple[RunRecord, Trace | None]]) -> RealRow:
    """A failed run is a lost one, and tells no distance."""
    errors = [trace.errors[trace.scored] for _, trace in found if trace is not None]
    distances = np.concatenate(errors) if errors else np.array([])
    return RealRow(
        sequence=sequence,
        label=label,
        targets=targets,
        seeds=len(found) // targets,
        runs=len(found),
        failed=sum(cell.score is None for cell, _ in found),
        lost=sum(cell.lost_or_failed for cell, _ in found),
        distance=float(np.median(distances)) if len(distances) else None,
        within=float(np.mean(distances <= 20)) if len(distances) else None,
    )
