"""The bench: sources by trackers by seeds, each cell once, kept in a results file."""

from __future__ import annotations

import multiprocessing
import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np

import irsim
from irsim.types import Box, Input, Source
from irtrack.bench.cell import Cell, Key, Run
from irtrack.bench.group import Group, Member, run_group
from irtrack.bench.plan import Plan, contestants, plans
from irtrack.bench.results import Results
from irtrack.bench.specs import Entry
from irtrack.errors import InputError, IrtrackError
from irtrack.metrics import Trace
from irtrack.types import GivenTracker
from irtrack.workers import begin_worker, one_thread

Progress = Callable[[int, int], None]
"""Called with (cells done, cells to do) as the bench goes on."""


def run_bench(
    sources: Sequence[str | Path | irsim.Scenario | Source],
    trackers: Sequence[str | GivenTracker | Entry],
    *,
    results: str | Path,
    seeds: int | Iterable[int] = 1,
    jobs: int = 1,
    input: Input = "display",
    target: str | None = None,
    init: tuple[Box, int] | None = None,
    command: str | None = None,
    progress: Progress | None = None,
) -> Results:
    """Run every tracker on every source with every seed; what the results file has is not run again.

    sources   scenarios and recordings, their names differing. Cell i of a scenario has scene seed i
              and tracker seed i, the same scenes for every tracker; a recording has tracker seeds only
    trackers  specs (`irtrack.bench.specs`), trackers, or entries; their labels differ
    seeds     how many (0, 1, ...), or which
    jobs      worker processes; the cells are the same for any number, times aside. With more than one
              the calling script needs the guard ``if __name__ == "__main__"``
    target    id of the target to follow in every source; without it each source's own
    init      (box, frame) to start from, for sources without truth
    command   the command line that asked for this, for the report; None where Python code does

    Returns the results file, open; its `run` is this one. A tracker's exception makes a failed cell; bad input is an
    InputError before anything is run.
    """
    compared = contestants(trackers)
    wanted = plans(sources, compared, _seeds(seeds), input, target, init)
    if jobs < 1:
        raise InputError(f"jobs {jobs}: allowed: 1 or more")
    kept = Results(results, create=True)
    try:
        with kept.transaction():
            run = kept.start_run(_now(), command, _versions())
            taken: set[Key] = set()
            groups = [group for plan in wanted if (group := _missing(kept, run, plan, taken)).members]
        done, total = 0, sum(len(group.members) for group in groups)
        for outcomes in _outcomes(groups, jobs):
            with kept.transaction():
                for cell, trace in outcomes:
                    kept.add(cell, trace)
            done += len(outcomes)
            if progress is not None:
                progress(done, total)
    except BaseException:
        kept.close()
        raise
    return kept


def _seeds(seeds: int | Iterable[int]) -> list[int]:
    found = list(range(seeds)) if isinstance(seeds, int) else list(seeds)
    if not found or min(found) < 0 or len(set(found)) < len(found):
        raise InputError(f"seeds {seeds}: allowed: at least one, from 0 up, none twice")
    return found


def _missing(kept: Results, run: Run, plan: Plan, taken: set[Key]) -> Group:
    """Note what the plan wants; its group with the cells that neither the file has nor a group before it.

    Two labels, or two names of one and the same scene, may stand for one cell.
    """
    kept.add_source(plan.row)
    missing: list[Member] = []
    for member in plan.group.members:
        kept.want(run, plan.row.name, member.label, member.key)
        if member.key not in taken and not kept.has(member.key):
            missing.append(member)
            taken.add(member.key)
    return replace(plan.group, members=tuple(missing))


def _outcomes(groups: list[Group], jobs: int) -> Iterator[list[tuple[Cell, Trace | None]]]:
    """What each group gives, as they finish."""
    if jobs == 1 or len(groups) <= 1:
        with one_thread():
            yield from map(run_group, groups)
        return
    context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
    with ProcessPoolExecutor(min(jobs, len(groups)), mp_context=context, initializer=begin_worker) as pool:
        try:
            for future in as_completed([pool.submit(run_group, group) for group in groups]):
                yield future.result()
        except BrokenProcessPool:
            raise IrtrackError("a worker process died; finished cells are kept, run it again to go on") from None
        finally:
            pool.shutdown(cancel_futures=True)


def _versions() -> dict[str, str]:
    return {
        "irtrack": irsim.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "platform": platform.platform(),
    }


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
