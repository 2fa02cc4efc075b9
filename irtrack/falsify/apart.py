"""Where a tracker runs: here, or in processes of their own, which it may hang or kill."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from time import monotonic
from typing import Any, Protocol, TypeVar

from irtrack.bench.crew import Board
from irtrack.bench.group import Group, Limit, Unwatched, Watch, run_group
from irtrack.errors import InputError, TrackerError
from irtrack.workers import Deaths, GoneError, NotSentError, Watched

Outcome = TypeVar("Outcome")

NO_LIMIT_S = 1e9
"""Thirty years: a number that JSON can hold."""


class Run(Protocol):
    """Gives function(watch, *given), which tells the watch when a tracker begins to work on a frame, and when it is
    done. LostError where the tracker ended its process, or had to be ended with it."""

    def __call__(self, function: Callable[..., Outcome], *given: object) -> Outcome: ...


def here(function: Callable[..., Outcome], *given: object) -> Outcome:
    """In this process: what the tracker does to it, it does to all."""
    return function(Unwatched(), *given)


class LostError(TrackerError):
    """A tracker's process died at a frame, or was ended there.

    frame      where it was, or had been last
    what       came of it, without the frame
    limit_s    what the tracker might take for a frame, s
    at_work    it was at work then; else it had been, and the source may have done it
    """

    def __init__(self, frame: int, what: str, limit_s: float, at_work: bool) -> None:
        super().__init__(f"frame {frame}: {what}")
        self.frame, self.what, self.limit_s, self.at_work = frame, what, limit_s, at_work


class Apart:
    """Processes as many as there are jobs; another one is started where one hangs or dies."""

    def __init__(self, jobs: int) -> None:
        self._all = [Watched(_begin, Board.EMPTY) for _ in range(jobs)]
        self._free: SimpleQueue[Watched] = SimpleQueue()
        for watched in self._all:
            self._free.put(watched)

    def within(self, limit_s: float) -> Run:
        """A `Run` there, where a tracker that takes longer for a frame, s, hangs; from as many threads as there are
        jobs. InputError for a tracker that cannot be sent there."""
        return partial(self._run, limit_s)

    def _run(self, limit_s: float, function: Callable[..., Outcome], *given: object) -> Outcome:
        watched, deaths = self._free.get(), Deaths()
        try:
            while True:
                try:
                    outcome: Outcome = watched.ask((limit_s, function, given))
                    return outcome
                except NotSentError as error:
                    raise InputError(f"the tracker cannot be sent to a worker process: {error}") from None
                except GoneError as gone:
                    if watched.closed:
                        raise
                    number, frame = Board.read(gone)
                    at_work = number is not None
                    if at_work and gone.hung:
                        what: str | None = Limit(limit_s, "frame").exceeded()
                    else:
                        what = deaths.failure(None if frame is None else "the tracker", gone.how, at_work)
                    if frame is not None and what is not None:
                        raise LostError(frame, what, limit_s, at_work) from None
        finally:
            self._free.put(watched)

    def close(self) -> None:
        """End the processes, whatever they are at."""
        for watched in self._all:
            watched.close()


@contextmanager
def apart(jobs: int) -> Iterator[Apart]:
    """Processes that end with the block."""
    processes = Apart(jobs)
    try:
        yield processes
    finally:
        processes.close()


@contextmanager
def running(jobs: int, limit_s: float | None) -> Iterator[Run]:
    """Here, with one job and no limit; else apart."""
    if jobs == 1 and limit_s is None:
        yield here
        return
    with apart(jobs) as processes:
        yield processes.within(NO_LIMIT_S if limit_s is None else limit_s)


class Groups(Executor):
    """Runs the groups of a bench by a `Run`, one after the other."""

    def __init__(self, run: Run) -> None:
        self._run = run

    def submit(self, task: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The outcomes of args[0], a group with a single member: whoever is lost is known."""
        (group,) = args
        (member,) = group.members
        future: Future[Any] = Future()
        try:
            future.set_result(self._run(_run_group, group))
        except LostError as lost:
            if not lost.at_work:
                self._run(_run_group, group.of(()))  # raises where the source ends processes by itself
            future.set_result([group.failed(member, lost.what, lost.frame)])
        return future


def _run_group(watch: Watch, group: Group) -> Any:
    return run_group(group, watch=watch)


class FrameLimit(Board):
    """A board for a tracker that may take so long for each frame, s."""

    def __init__(self, numbers: Any, limit_s: float) -> None:
        super().__init__(numbers)
        self._limit_s = limit_s

    def begin(self, member: int, frame: int, deadline: float) -> None:
        super().begin(member, frame, min(deadline, monotonic() + self._limit_s))


def _begin(numbers: Any) -> Callable[[tuple[float, Callable[..., Any], tuple[object, ...]]], Any]:
    """What a process does with its work."""

    def work(asked: tuple[float, Callable[..., Any], tuple[object, ...]]) -> Any:
        limit_s, function, given = asked
        return function(FrameLimit(numbers, limit_s), *given)

    return work
