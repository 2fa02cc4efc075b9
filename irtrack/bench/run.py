"""Execution of a bench: groups of runs that share frames run in this process, in workers, or on an executor."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, as_completed
from copy import copy
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, cast
from weakref import WeakSet

import cv2
import numpy as np

import irsim
from irsim.types import Box, Frame, Input, Source
from irtrack.bench.frame_cache import FrameCache, truths_of
from irtrack.bench.plan import Group, Member, Outcome, Plan, Seeds, plans, tracker_specs
from irtrack.bench.records import Key, Run, RunRecord
from irtrack.bench.results import Results
from irtrack.bench.spec import AnySource, Entry, SourceEntry, SourceSpec
from irtrack.errors import InputError, IrtrackError, TrackerError, WorkerError, whole_number
from irtrack.metrics import Reference, Trace
from irtrack.metrics.ceiling import Ceiling, IdealMatchedFilter
from irtrack.metrics.tasks import task_scores
from irtrack.replay.many import DetectorPlayer, ManyPlayer, auto_start
from irtrack.replay.replay import Pair, Player, replay, show
from irtrack.replay.start import find_start
from irtrack.runner.pool import Pool
from irtrack.runner.watchdog import NO_LIMIT, Blame, Heartbeat, Limit
from irtrack.runner.worker import one_thread
from irtrack.types import GivenTracker


def run_group(group: Group, heartbeat: Heartbeat | None = None, cache: FrameCache | None = None) -> list[Outcome]:
    """Run all members of a group. A tracker that raises an exception fails its own run and no other.

    cache   cache of frames, where one process runs several groups

    Exceptions raised by the source (a damaged recording) are passed on.
    """
    source = copy(group.source)  # a copy, so that caches of the source are freed after the group
    cache = cache or FrameCache()
    heartbeat = heartbeat or Heartbeat()
    pairs = cache.pairs(source, group.input)
    if group.task != "single":
        return _run_from_frame_0(group, source, pairs, heartbeat)
    try:
        if isinstance(group.init, str):
            start = auto_start(source, group.input, group.init.partition(":")[2] or "lcm")
        else:
            start = find_start(source, source.truths() if pairs is None else truths_of(pairs), group.target, group.init)
    except IrtrackError as error:
        return [group.failed(member, str(error)) for member in group.members]
    attempts = [
        _Attempt(Player(member.tracker, start, member.key.tracker_seed), number, heartbeat)
        for number, member in enumerate(group.members)
    ]
    viewers = [attempt.see for attempt in attempts]
    if pairs is None:
        reference = Reference.of(replay(source, viewers, group.input, start.frame), start.target)
    else:
        show(pairs[start.frame :], viewers)
        reference = cache.reference(start.target, start.frame)
    return [
        group.failed(member, attempt.failure, attempt.at)
        if attempt.failure is not None
        else group.finished(member, Trace.of(attempt.player.track(source, group.input), reference))
        for member, attempt in zip(group.members, attempts, strict=True)
    ]


def _run_from_frame_0(group: Group, source: Source, pairs: list[Pair] | None, heartbeat: Heartbeat) -> list[Outcome]:
    """Run detectors or trackers of many, which need no box, and compute the ceiling of detectors."""
    kind = DetectorPlayer if group.task == "detect" else ManyPlayer
    whole, group = group, group.of([m for m in group.members if not isinstance(m.tracker, IdealMatchedFilter)])
    players = [kind(member.tracker, seed=member.key.tracker_seed) for member in group.members]
    attempts = [_Attempt(player, number, heartbeat) for number, player in enumerate(players)]
    viewers = [attempt.see for attempt in attempts]
    truths = replay(source, viewers, group.input, 0) if pairs is None else show(pairs, viewers)
    outcomes = []
    for member, attempt, player in zip(group.members, attempts, players, strict=True):
        if attempt.failure is not None:
            outcomes.append(group.failed(member, attempt.failure, attempt.at))
        else:
            found = player.result(source, group.input)
            figures, arrays = task_scores(found, truths, source.rate_hz)
            outcomes.append(group.scored(member, figures, found.arrays() | arrays))
    for member in whole.members[len(group.members) :]:
        ceiling = Ceiling.of(cast(irsim.Rendering, source).scenario, truths)
        outcomes.append(group.scored(member, ceiling.figures(), {"d2": ceiling.d2, "share": ceiling.share}))
    return outcomes


class _Attempt:
    """Player of one tracker; after a failure the tracker gets no more frames."""

    def __init__(self, player: Any, number: int, heartbeat: Heartbeat) -> None:
        self.player = player
        self.failure: str | None = None
        self.at: int | None = None
        self._number = number
        self._heartbeat = heartbeat

    def see(self, frame: Frame) -> None:
        if self.failure is not None:
            return
        try:
            with self._heartbeat.frame(frame.index, self._number):
                self.player.see(frame)
        except TrackerError as error:
            self.failure, self.at = (error.trace(), frame.index) if error.__cause__ else (str(error), None)
        except IrtrackError as error:
            self.failure = str(error)
        else:
            if self._heartbeat.overdue:  # the frame ended after its deadline, but before the watchdog noticed
                self.failure, self.at = self._heartbeat.limit.exceeded(), frame.index


Progress = Callable[[int, int], None]
"""Called with (runs done, runs to do) as the bench goes on."""


def run_bench(
    sources: Sequence[AnySource | SourceEntry | SourceSpec],
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
    init: tuple[Box, int] | str | None = None,
    command: str | None = None,
    progress: Progress | None = None,
    seen: Callable[[RunRecord], None] | None = None,
) -> Results:
    """Run every tracker on every source with every seed; runs in the results file are not repeated.

    sources   scenarios and recordings, or entries with changes and severities; no two have the same name
    trackers  specs (`irtrack.bench.spec`), trackers, or entries; no two have the same label
    seeds     a number (0, 1, ...) or a list. Run i of a scenario has scene seed i and tracker seed i, the same scenes
              for every tracker; a recording has tracker seeds only
    tracker_seeds   number of runs of each scene, each with another tracker seed (`irtrack.bench.plan.Seeds`)
    jobs      number of worker processes, on which only the measured times depend. With more than one, or
              with a time limit, the calling script needs the guard ``if __name__ == "__main__"``
    executor  any executor, such as dask's, in place of the worker processes; it is not closed
    time_limit_s   longest wall time of a tracker in one run, without rendering, s; a run that takes longer fails
    frame_limit_s  longest time for each frame, in place of the limit for a run
    target    id of the target to track in every source; by default that of each source
    init      (box, frame) to start from, for sources without truth; or 'auto', 'auto:DETECTOR': each run starts at
              the first confirmed track of `gnn` on a detector (`irtrack.replay.many.auto_start`)
    command   command line, for the report; None for Python code
    progress  called with (runs done, runs to do);  seen  called with the record of each run

    Returns the results file, open; its `run` is this call. A tracker that raises, hangs or dies makes a failed run.
    InputError for wrong input, before any run. WorkerError where workers died or failed and no tracker caused it:
    finished runs are kept, and the same call continues.
    """
    compared = tracker_specs(trackers)
    wanted = plans(sources, compared, Seeds.of(seeds, tracker_seeds), input, target, init)
    whole_number("jobs", jobs, 1)
    limit = _limit(time_limit_s, frame_limit_s)
    kept = Results(results, create=True)
    try:
        with kept.transaction():
            run = kept.start_run(datetime.now(UTC).isoformat(timespec="seconds"), command, _versions())
            taken: set[Key] = set()
            groups = [group for plan in wanted if (group := _missing(kept, run, plan, taken)).members]
        done, total = 0, sum(len(group.members) for group in groups)
        if progress is not None and total:
            progress(done, total)
        with kept.sweep():
            for outcomes in _outcomes(groups, jobs, executor, limit):
                with kept.transaction():
                    for cell, arrays in outcomes:
                        kept.add(cell, arrays)
                done += len(outcomes)
                if seen is not None:
                    for cell, _ in outcomes:
                        seen(cell)
                if progress is not None:
                    progress(done, total)
        if done != total:
            raise WorkerError(f"{done} of {total} runs were returned; finished runs are kept: give the same call again")
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
    """Store the runs of the plan; return its group with the runs that neither the file nor an earlier group has.

    Two labels, or two names of the same scene, may share one run.
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
    """Yield the outcomes of each group as it finishes."""
    if executor is not None:
        yield from _by(executor, run_alone if limit is None else partial(run_limited, limit=limit), groups)
    elif limit is None and jobs == 1:
        yield from map(partial(run_alone, cache=FrameCache()), groups)
    elif groups:
        with Pool(min(jobs, len(groups))) as pool:
            yield from _by(pool, partial(_run_in, pool, limit or NO_LIMIT), groups)


def _by(executor: Executor, task: Callable[[Group], list[Outcome]], groups: list[Group]) -> Iterator[list[Outcome]]:
    futures = [executor.submit(task, group) for group in groups]
    waiting, done = WeakSet(futures), as_completed(futures)
    del futures  # each future is freed, with its tracks, when its outcomes have been yielded
    try:
        for future in done:
            try:
                found = future.result()
            except IrtrackError:
                raise
            except CancelledError:
                raise WorkerError("no worker is left; finished runs are kept: give the same call again") from None
            except Exception as error:
                what = " ".join(f"{type(error).__name__}: {error}".split())
                raise WorkerError(f"a worker failed: {what}") from error
            yield found
    finally:
        for future in list(waiting):  # otherwise the caller's executor would run the remaining groups
            future.cancel()


def run_alone(group: Group, cache: FrameCache | None = None) -> list[Outcome]:
    """Run a group in this process."""
    with one_thread():
        return run_group(group, cache=cache)


def run_limited(group: Group, limit: Limit) -> list[Outcome]:
    """Run a group in a new worker process, started by this process (which may be an executor's worker)."""
    with Pool(1) as pool:
        return _run_in(pool, limit, group)


def _run_in(pool: Pool, limit: Limit, group: Group) -> list[Outcome]:
    """Run a group in a worker of a pool; a tracker that hangs or kills the worker fails alone."""
    answers = pool.run(_run_members, group.members, group.of(()), limit=limit, name=group.name)
    return [
        group.failed(member, answer.what, answer.frame) if isinstance(answer, Blame) else answer
        for member, answer in zip(group.members, answers, strict=True)
    ]


_worker_cache = FrameCache()
"""Cache of frames of a worker process, which runs one group at a time."""


def _run_members(heartbeat: Heartbeat, members: Sequence[Member], group: Group) -> list[Outcome]:
    return run_group(group.of(members), heartbeat, _worker_cache)


def _versions() -> dict[str, str]:
    return {
        "irtrack": irsim.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "platform": platform.platform(),
    }
