"""Recordings of real cameras with loose labels: all trackers and peers, every labelled target from its first frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import irsim
from irtrack.bench import Entry, parse_tracker_spec, run_bench
from irtrack.errors import InputError
from irtrack.sources.hard import OURS, THEIRS

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


def sequences(folder: Path) -> list[Path]:
    """The sequences in a folder: sub-folders with a video and its labels. InputError where there is none."""
    found = sorted(path.parent for path in folder.glob(f"*/{LABELS}") if path.with_name("frames.mp4").is_file())
    if not found:
        raise InputError(f"{folder}: holds no sequence; allowed: a folder of folders with frames.mp4 and {LABELS}")
    return found


def real_rows(folder: Path, work: Path, results: Path, jobs: int, seeds: int = TRACKER_SEEDS) -> list[RealRow]:
    """A row for each tracker on each sequence. Recordings are made in `work`, which must not be kept with the page."""
    found = []
    for sequence in sequences(folder):
        recording = work / f"{sequence.name}.mcap"
        if not recording.exists():
            irsim.import_frames(sequence / "frames.mp4", recording, truth=sequence / LABELS)
        source = irsim.open_recording(recording)
        targets = sorted({target.id for truth in source.truths() for target in truth.targets})
        for draws, trackers in ((True, _random(OURS | THEIRS)), (False, _steady(OURS | THEIRS))):
            entries = _entries(trackers)
            found += _rows(source, sequence.name, targets, entries, results, jobs, seeds if draws else 1)
    return sorted(found, key=lambda row: (row.sequence, row.lost / row.runs, row.distance or np.inf))


def _rows(
    source: irsim.Source, name: str, targets: list[str], entries: list[Entry], results: Path, jobs: int, seeds: int
) -> list[RealRow]:
    distances: dict[str, list[np.ndarray]] = {entry.label: [] for entry in entries}
    lost = dict.fromkeys(distances, 0)
    failed = dict.fromkeys(distances, 0)
    for target in targets:
        kept = run_bench([source], entries, results=results, seeds=seeds, jobs=jobs, target=target)
        with kept:
            for cell in kept.cells(run=kept.run):
                trace = kept.trace(cell.key)
                if cell.score is None or trace is None:
                    failed[cell.label] += 1
                    lost[cell.label] += 1
                    continue
                lost[cell.label] += cell.score.lost is True
                distances[cell.label].append(trace.errors[trace.scored])
    rows = []
    for label, each in distances.items():
        errors = np.concatenate(each) if each else np.array([])
        rows.append(
            RealRow(
                sequence=name,
                label=label,
                targets=len(targets),
                seeds=seeds,
                runs=len(targets) * seeds,
                failed=failed[label],
                lost=lost[label],
                distance=float(np.median(errors)) if len(errors) else None,
                within=float(np.mean(errors <= 20)) if len(errors) else None,
            )
        )
    return rows


def _entries(trackers: Mapping[str, str]) -> list[Entry]:
    entries = []
    for label, spec in trackers.items():
        try:
            entries.append(Entry(label, parse_tracker_spec(spec).tracker))
        except InputError:  # a peer that is not installed
            continue
    return entries


def _draws(spec: str) -> bool:
    name = spec.partition(":")[0]
    return name.endswith(("pf", "cv_mil"))


def _random(trackers: Mapping[str, str]) -> dict[str, str]:
    """Those that draw random numbers; the others do the same with every seed."""
    return {label: spec for label, spec in trackers.items() if _draws(spec)}


def _steady(trackers: Mapping[str, str]) -> dict[str, str]:
    return {label: spec for label, spec in trackers.items() if not _draws(spec)}
