"""The bench: sources by trackers by seeds, each cell once, kept in a results file."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from weakref import WeakSet

import cv2
import numpy as np

import irsim
from irsim.types import Box, Input
from irtrack.bench.asked import AnySource, Asked, SourceEntry
from irtrack.bench.cell import Cell, Key, Run
from irtrack.bench.crew import Crew, warden
from irtrack.bench.group import Group, Member, Outcome, run_group
from irtrack.bench.plan import Plan, Seeds, contestants, plans
from irtrack.bench.reel import Reels
from irtrack.bench.results import Results
from irtrack.bench.specs import Entry
from irtrack.errors import InputError, IrtrackError, WorkerError, whole_number
from irtrack.runner import NO_LIMIT, Limit, one_thread
from irtrack.types import GivenTracker

Progress = Callable[[int, int], None]
"""Called with (cells done, cells to do) as the bench goes on."""


def run_bench(
    sources: Sequence[AnySource | SourceEntry | Asked],
    trackers: Sequence[str | GivenTracker | Entry],
    *,
    results: str | Path,
    seeds: int | Iterable[int] = 1,
    tracker_seeds: int = 1,
    jobs: int = 1,
    executor: Executor | None = None,
    time_limit_s: float | None = None,
    frame_limit_s: float | None = None,
    input: Input = "display",
    target: str | None = None,
    init: tuple[Box, int] | None = None,
    command: str | None = None,
    progress: Progress | None = None,
    seen: Callable[[Cell], None] | None = None,
) -> Results:
    """Run every tracker on every source with every seed; what the results file has is not run again.

    sources   scenarios and recordings, or entries that say their changes and severities; their names differ
    trackers  specs (`irtrack.bench.specs`), trackers, or entries; their labels differ
    seeds     how many (0, 1, ...), or which. Cell i of a scenario has scene seed i and tracker seed i, the
              same scenes for every tracker; a recording has tracker seeds only
    tracker_seeds   how often each scene is run, each time with another tracker seed (`irtrack.bench.plan.Seeds`)
    jobs      worker processes; the cells are the same for any number, times aside. With more than one, or
              with a time limit, the calling script needs the guard ``if __name__ == "__main__"``
    executor  any executor in place of those processes, such as dask's; it is left open
    time_limit_s   a tracker that takes more wall time in one cell, rendering apart, is stopped: the cell failed
    frame_limit_s  in place of it, the same for each frame
    target    id of the target to follow in every source; without it each source's own
    init      (box, frame) to start from, for sources without truth
    command   the command line that asked for this, for the report; None where Python code does
    progress  called with (cells done, cells to do);  seen  called with each cell that is done

    Returns the results file, open; its `run` is this one. A tracker's exception makes a failed cell; bad input is an
    InputError before anything is run. WorkerError where workers died or failed and no tracker did it: what
    was finished is kept, and the same call goes on.
    """
    compared = contestants(trackers)
    wanted = plans(sources, compared, Seeds.of(seeds, tracker_seeds), input, target, init)
    whole_number("jobs", jobs, 1)
    limit = _limit(time_limit_s, frame_limit_s)
    kept = Results(results, create=True)
    try:
        with kept.transaction():
            run = kept.start_run(_now(), command, _versions())
            taken: set[Key] = set()
            groups = [group for plan in wanted if (group := _missing(kept, run, plan, taken)).members]
        done, total = 0, sum(len(group.members) for group in groups)
        if progress is not None and total:
            progress(done, total)
        with kept.sweep():
            for outcomes in _outcomes(groups, jobs, executor, limit):
                with kept.transaction():
                    for cell, trace in outcomes:
                        kept.add(cell, trace)
                done += len(outcomes)
                if seen is not None:
                    for cell, _ in outcomes:
                        seen(cell)
                if progress is not None:
                    progress(done, total)
    except BaseException:
        kept.close()
        raise
    return kept


def _limit(run_s: float | None, frame_s: float | None) -> Limit | None:
    if run_s is not None and frame_s is not None:
        raise InputError("a time limit for runs and one for frames: allowed: one of them")
    seconds = frame_s if run_s is None else run_s
    if seconds is None:
        return None
    if not seconds > 0:
        raise InputError(f"time limit {seconds:g} s: allowed: above 0")
    return Limit(seconds, "frame" if run_s is None else "run")


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
    return plan.group.of(missing)


def _outcomes(
    groups: list[Group], jobs: int, executor: Executor | None, limit: Limit | None
) -> Iterator[list[Outcome]]:
    """What each group gives, as they finish."""
    if executor is not None:
        yield from _by(executor, run_alone if limit is None else partial(run_warded, limit=limit), groups)
    elif limit is None and jobs == 1:
        yield from map(partial(run_alone, reels=Reels()), groups)
    elif groups:
        with Crew(min(jobs, len(groups)), limit or NO_LIMIT) as crew:
            try:
                yield from _by(crew, run_group, groups)
            finally:
                crew.shutdown(cancel_futures=True)


def _by(executor: Executor, task: Callable[[Group], list[Outcome]], groups: list[Group]) -> Iterator[list[Outcome]]:
    futures = [executor.submit(task, group) for group in groups]
    waiting, done = WeakSet(futures), as_completed(futures)
    del futures  # each is let go, with the tracks in it, when it has been yielded
    try:
        for future in done:
            try:
                found = future.result()
            except IrtrackError:
                raise
            except Exception as error:
                what = " ".join(f"{type(error).__name__}: {error}".split())
                raise WorkerError(f"a worker failed: {what}") from error
            yield found
    finally:
        for future in list(waiting):  # nobody listens: an executor of the caller's would go on with them
            future.cancel()


def run_alone(group: Group, reels: Reels | None = None) -> list[Outcome]:
    """A group in this process."""
    with one_thread():
        return run_group(group, reels=reels)


def run_warded(group: Group, limit: Limit) -> list[Outcome]:
    """A group in a process of this one's own, which can be stopped."""
    with warden(limit) as found:
        return found.run(group)


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
