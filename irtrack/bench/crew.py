"""Worker processes of this machine, watched: one that hangs or dies costs nobody else a result."""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import Any

from irtrack.bench.group import Group, Limit, Member, Outcome, run_group
from irtrack.bench.reel import Reels
from irtrack.errors import InputError, IrtrackError
from irtrack.workers import Deaths, GoneError, NotSentError, Watched


class Crew(Executor):
    """`run_group` in worker processes, as many at a time as there are jobs.

    A tracker that takes more than its limit is stopped with its process, one whose processes
    die has failed; its companions are run again. Where a process dies and nobody was at work, they are run one at a
    time: one of them may have left it unable to go on. With several jobs the calling script needs the guard
    ``if __name__ == "__main__"``.
    """

    def __init__(self, jobs: int, limit: Limit) -> None:
        self._wardens = [Warden(limit) for _ in range(jobs)]
        self._free: SimpleQueue[Warden] = SimpleQueue()
        for warden in self._wardens:
            self._free.put(warden)
        self._threads = ThreadPoolExecutor(jobs)  # they only wait for the processes

    def submit(self, task: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The future of `run_group(group)`; nothing else can be asked of a crew."""
        assert task is run_group
        return self._threads.submit(self._run, *args)

    def _run(self, group: Group) -> list[Outcome]:
        warden = self._free.get()
        try:
            return warden.run(group)
        finally:
            self._free.put(warden)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes, whatever they are at."""
        for warden in self._wardens:
            warden.close()
        self._threads.shutdown(wait, cancel_futures=cancel_futures)


@contextmanager
def warden(limit: Limit) -> Iterator[Warden]:
    """A warden, its process ended with the block."""
    found = Warden(limit)
    try:
        yield found
    finally:
        found.close()


class Warden:
    """One worker process at a time: another one is started where that one hangs or dies."""

    def __init__(self, limit: Limit) -> None:
        if multiprocessing.current_process().daemon:
            raise IrtrackError(
                "a time limit takes workers that may start processes; allowed for dask: "
                "DASK_DISTRIBUTED__WORKER__DAEMON=False dask worker ..."
            )
        self.limit = limit
        self._process = Watched(_begin, Board.EMPTY, limit)

    def run(self, group: Group) -> list[Outcome]:
        """The outcomes of all members, in their order. What the source raises is passed on."""
        found: dict[Member, Outcome] = {}
        deaths, together = Deaths(group.name), True
        while left := [member for member in group.members if member not in found]:
            asked = left if together else left[:1]
            try:
                found |= zip(asked, self._process.ask(group.of(asked)), strict=True)
            except NotSentError as error:
                raise InputError(f"{group.name}: cannot be sent to a worker process: {error}") from None
            except GoneError as gone:
                if self._process.closed:
                    raise
                number, frame = Board.read(gone)
                if number is None and len(asked) > 1:
                    together = False
                    continue
                member = None if frame is None else asked[number or 0]
                if number is not None and gone.hung:
                    failure: str | None = self.limit.exceeded()
                else:
                    failure = deaths.failure(member, gone.how, number is not None)
                if member is not None and failure is not None:
                    if number is None:
                        self._run_without_trackers(group)
                    found[member] = group.failed(member, failure, frame)
        return [found[member] for member in group.members]

    def _run_without_trackers(self, group: Group) -> None:
        """IrtrackError where the source ends processes by itself."""
        deaths, done = Deaths(group.name), False
        while not done:
            try:
                done = self._process.ask(group.of(())) == []
            except GoneError as gone:
                if self._process.closed:
                    raise
                deaths.failure(None, gone.how)

    def close(self) -> None:
        """End the process, whatever it is at; a warden that is waiting for it raises."""
        self._process.close()


class Board:
    """What a worker is at, in memory that its parent sees: member (-1: none), the frame that one is at, or was last
    (-1: none was), when it must be done."""

    EMPTY = (-1.0, -1.0, math.inf)

    def __init__(self, numbers: Any) -> None:
        self._numbers = numbers

    def begin(self, member: int, frame: int, deadline: float) -> None:
        self._numbers[0], self._numbers[1] = member, frame
        self._numbers[2] = deadline

    def end(self) -> None:
        self._numbers[2] = math.inf
        self._numbers[0] = -1

    @staticmethod
    def read(gone: GoneError) -> tuple[int | None, int | None]:
        """Who was at work when the process was lost, None where nobody was; at which frame somebody was last, None
        where nobody had been."""
        number, frame = map(int, gone.at[:2])
        return None if number < 0 or gone.went_on else number, None if frame < 0 else frame


def _begin(numbers: Any, limit: Limit) -> Callable[[Group], list[Outcome]]:
    """What a worker does with each group."""
    return partial(run_group, limit=limit, watch=Board(numbers), reels=Reels())
