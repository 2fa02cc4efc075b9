"""Where a tracker runs: here, or in processes of their own, which it may hang or kill."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from time import monotonic
from typing import Any, Protocol, TypeVar

from irtrack.bench.run import Group, run_group
from irtrack.errors import TrackerError
from irtrack.runner import Blame, Board, Limit, Pool, Unwatched, Watch, Watched, answer_or_blame

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

    blame      where, and what came of it
    limit_s    what the tracker might take for a frame, s
    """

    def __init__(self, blame: Blame, limit_s: float) -> None:
        super().__init__(f"frame {blame.frame}: {blame.what}")
        self.blame, self.limit_s = blame, limit_s


class Processes:
    """Processes that trackers run in, as many as there are jobs; one that hangs or dies is replaced."""

    def __init__(self, jobs: int) -> None:
        self._processes = Pool(jobs, partial(Watched, _begin))

    def within(self, limit_s: float) -> Run:
        """A `Run` there, where a tracker that takes longer for a frame, s, hangs; from as many threads as there are
        jobs. InputError for a tracker that cannot be sent there."""
        return partial(self._run, limit_s)

    def _run(self, limit_s: float, function: Callable[..., Outcome], *given: object) -> Outcome:
        with self._processes.one() as process:
            answer = answer_or_blame(process, (limit_s, function, given), Limit(limit_s, "frame").exceeded())
        if isinstance(answer, Blame):
            raise LostError(answer, limit_s)
        outcome: Outcome = answer
        return outcome

    def close(self) -> None:
        """End the processes, whatever they are at."""
        self._processes.close()


@contextmanager
def apart(jobs: int) -> Iterator[Processes]:
    """Processes that end with the block."""
    processes = Processes(jobs)
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
            if not lost.blame.at_work:
                self._run(_run_group, group.of(()))  # raises where the source ends processes by itself
            future.set_result([group.failed(member, lost.blame.what, lost.blame.frame)])
        return future


def _run_group(watch: Watch, group: Group) -> Any:
    return run_group(group, watch=watch)


class FrameLimit:
    """A watch of a tracker that may take so long for each frame, s."""

    def __init__(self, board: Board, limit_s: float) -> None:
        self._board, self._limit_s = board, limit_s

    def begin(self, member: int, frame: int, deadline: float) -> None:
        self._board.begin(member, frame, min(deadline, monotonic() + self._limit_s))

    def end(self) -> None:
        self._board.end()


def _begin(board: Board) -> Callable[[tuple[float, Callable[..., Any], tuple[object, ...]]], Any]:
    """What a process does with its work."""

    def work(asked: tuple[float, Callable[..., Any], tuple[object, ...]]) -> Any:
        limit_s, function, given = asked
        return function(FrameLimit(board, limit_s), *given)

    return work
