"""Baseline: the stored metrics of every run of a suite, and their comparison with a new measurement."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from irsim.recording.output import atomic_text
from irtrack.bench import RunRecord, Suite, run_bench, value
from irtrack.bench.run import Progress
from irtrack.errors import InputError
from irtrack.metrics import FIGURES

HELD = ("lost", "error", "off_share", "success_auc", "lt_f")
"""Metrics that a baseline holds, by name in `irtrack.metrics.FIGURES`: loss, error and overlap."""

TOLERANCE = 0.04
"""Largest relative change of a metric that is ignored: rounding on another machine may change a particle filter."""

FLOOR = 0.002
"""Absolute change, in the unit of the metric, that is ignored in addition, since a metric may be 0."""

Run: TypeAlias = tuple[str, str, int]
"""(name of the source, label of the tracker, seed)."""

Baseline: TypeAlias = Mapping[Run, Mapping[str, float | None]]
"""Metrics of each run by name; None where a metric is undefined for the run."""


@dataclass(frozen=True, slots=True)
class Change:
    """Changed metric of one run; `old`, `new`: None where undefined. `figure` is 'run' where only one side has the
    run."""

    run: Run
    figure: str
    old: float | None
    new: float | None
    verdict: Literal["better", "worse", "new", "gone"]


def baseline_file(suite: Path) -> Path:
    """Return the file beside a suite that holds its baseline."""
    return suite.with_suffix(".golden.json")


def measure(
    suite: Suite,
    jobs: int = 1,
    progress: Progress | None = None,
    frame_limit_s: float | None = None,
    seen: Callable[[RunRecord], None] | None = None,
) -> Baseline:
    """Run the suite and return the metrics of its runs; a failed run counts as lost and has no other metric.

    frame_limit_s  longest time of a tracker for one frame, s; a limit for a whole run in the suite takes precedence.
                   Trackers then run in worker processes: a tracker that takes longer is stopped, and one that dies
                   fails alone
    seen           called with the record of each run
    """
    with tempfile.TemporaryDirectory() as scratch:
        kept = run_bench(
            suite.sources,
            suite.trackers,
            results=Path(scratch) / "baseline.db",
            seeds=suite.seeds,
            tracker_seeds=suite.tracker_seeds,
            jobs=jobs,
            time_limit_s=suite.time_limit_s,
            frame_limit_s=frame_limit_s if suite.time_limit_s is None else None,
            input=suite.input,
            progress=progress,
            seen=seen,
        )
        with kept:
            cells = kept.cells(run=kept.run)
    found: dict[Run, Mapping[str, float | None]] = {}
    for cell in cells:
        run = (cell.source, cell.label, cell.key.tracker_seed)
        figures = {name: value(cell, name) for name in HELD}
        found[run] = {name: None if math.isnan(known) else float(f"{known:.6g}") for name, known in figures.items()}
    return found


def changes(old: Baseline, new: Baseline) -> list[Change]:
    """Return the changes larger than `TOLERANCE` and `FLOOR` allow, in the order of the runs."""
    found: list[Change] = []
    for run in sorted({*old, *new}):
        if run not in old or run not in new:
            found.append(Change(run, "run", None, None, "new" if run in new else "gone"))
            continue
        for name in HELD:
            was, now = old[run].get(name), new[run][name]
            if (verdict := _verdict(name, was, now)) is not None:
                found.append(Change(run, name, was, now, verdict))
    return found


def _verdict(name: str, was: float | None, now: float | None) -> Literal["better", "worse", "new", "gone"] | None:
    if was is None or now is None:
        return None if was is now else ("new" if was is None else "gone")
    if abs(now - was) <= TOLERANCE * abs(was) + FLOOR:
        return None
    return "worse" if (now > was) == (FIGURES[name].better == "less") else "better"


def read(path: Path) -> Baseline:
    """Return the baseline in a file; InputError where there is none."""
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))
        return {(row["source"], row["tracker"], row["seed"]): row["figures"] for row in rows}
    except FileNotFoundError:
        raise InputError(f"{path}: there is no baseline yet; irtrack regress --update writes it") from None
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise InputError(f"{path}: holds no baseline: {error!r}") from None


def write(baseline: Baseline, path: Path) -> None:
    """Write the baseline, one line per run, so that a changed run is one line of a diff."""
    rows = [
        json.dumps({"source": source, "tracker": label, "seed": seed, "figures": figures})
        for (source, label, seed), figures in sorted(baseline.items())
    ]
    with atomic_text(path) as file:
        file.write("[\n" + ",\n".join(rows) + "\n]\n")
