"""Worker processes of this machine, watched: one that hangs or dies costs nobody else a result."""

from __future__ import annotations

import math
import multiprocessing
import pickle
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any

from irsim.interrupts import ignore_interrupts
from irtrack.bench.group import Group, Member, Outcome, run_group, timed_out
from irtrack.bench.reel import Reels
from irtrack.errors import InputError, IrtrackError
from irtrack.workers import GoneError, Watched, begin_worker

MOST_DEATHS = 2
"""A worker may be killed by chance once (memory, an operator); a tracker on which two died has killed them."""


class Crew(Executor):
    """`run_group` in worker processes, as many at a time as there are jobs.

    A tracker that takes more than `limit_s` in all is stopped with its process, one whose processes
    die has failed; its companions are run again. With several jobs the calling script needs the guard
    ``if __name__ == "__main__"``.
    """

    def __init__(self, jobs: int, limit_s: float | None) -> None:
        self._wardens = [Warden(limit_s) for _ in range(jobs)]
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
def warden(limit_s: float | None) -> Iterator[Warden]:
    """A warden, its process ended with the block."""
    found = Warden(limit_s)
    try:
        yield found
    finally:
        found.close()


class Warden:
    """One worker process at a time: another one is started where that one hangs or dies."""

    def __init__(self, limit_s: float | None) -> None:
        self.limit_s = limit_s
        self._child: Child | None = None
        self._closed = False

    def run(self, group: Group) -> list[Outcome]:
        """The outcomes of all members, in their order. What the source raises is passed on."""
        found: dict[Member, Outcome] = {}
        deaths: Counter[Member | None] = Counter()
        while left := [member for member in group.members if member not in found]:
            try:
                found |= zip(left, self._ready().run(group.of(left)), strict=True)
            except WorkerLostError as lost:
                self._child = None
                if self._closed:
                    raise
                member = None if lost.member is None else left[lost.member]
                deaths[member] += 1
                if member is None:
                    if deaths[member] > MOST_DEATHS:
                        raise IrtrackError(
                            f"{group.name}: a worker process died again and again while no tracker was at work "
                            f"({lost.how}); finished cells are kept, run it again to go on"
                        ) from None
                elif lost.in_time and deaths[member] < MOST_DEATHS:
                    continue
                elif self.limit_s is not None and not lost.in_time:
                    found[member] = group.failed(member, timed_out(self.limit_s), lost.frame)
                else:
                    what = f"the process died {MOST_DEATHS} times while the tracker was at work"
                    found[member] = group.failed(member, f"{what} ({lost.how})", lost.frame)
        return [found[member] for member in group.members]

    def _ready(self) -> Child:
        if self._child is None:
            self._child = Child(self.limit_s)
            if self._closed:  # meanwhile
                self._child.kill()
        return self._child

    def close(self) -> None:
        """End the process, whatever it is at; a warden that is waiting for it raises."""
        self._closed = True
        if self._child is not None:
            self._child.kill()


class WorkerLostError(Exception):
    """A worker has gone: which member it was at (None: none), at which frame, whether in time, and how it ended."""

    def __init__(self, member: int | None, frame: int, in_time: bool, how: str) -> None:
        super().__init__(how)
        self.member, self.frame, self.in_time, self.how = member, frame, in_time, how


class Child:
    """A worker process, watched by the board on which it says what it is at."""

    def __init__(self, limit_s: float | None) -> None:
        if multiprocessing.current_process().daemon:
            raise IrtrackError(
                "a time limit takes workers that may start processes; allowed for dask: "
                "DASK_DISTRIBUTED__WORKER__DAEMON=False dask worker ..."
            )
        self._process = Watched(_serve, Board.EMPTY, limit_s)

    def run(self, group: Group) -> list[Outcome]:
        """The outcomes of a group; WorkerLostError where the process is gone or had to be ended."""
        try:
            self._send(group)
            answer = self._process.answer()
        except GoneError as gone:
            member, frame, _ = gone.at
            in_time = gone.moved or not gone.overdue
            raise WorkerLostError(None if member < 0 else int(member), int(frame), in_time, gone.how) from None
        if isinstance(answer, BaseException):
            raise answer
        outcomes: list[Outcome] = answer
        return outcomes

    def _send(self, group: Group) -> None:
        try:
            self._process.send(group)
        except GoneError:
            raise
        except Exception as error:  # pickle raises all sorts
            what = " ".join(str(error).split())
            raise InputError(f"{group.name}: cannot be sent to a worker process: {what}; allowed: --jobs 1") from None

    def kill(self) -> None:
        self._process.kill()


class Board:
    """What a worker is at, in memory that its parent sees: member (-1: none), frame, when it must be done."""

    EMPTY = (-1.0, 0.0, math.inf)

    def __init__(self, numbers: Any) -> None:
        self._numbers = numbers

    def begin(self, member: int, frame: int, deadline: float) -> None:
        self._numbers[0], self._numbers[1] = member, frame
        self._numbers[2] = deadline

    def end(self) -> None:
        self._numbers[2] = math.inf
        self._numbers[0] = -1


def _serve(pipe: Connection, numbers: Any, limit_s: float | None) -> None:
    """A worker's life: groups in, outcomes out."""
    ignore_interrupts()  # of Ctrl-C the parent tells: one that is gone would be replaced
    begin_worker()
    reels = Reels()
    while True:
        answer: Any
        try:
            group = pipe.recv()
        except EOFError:
            return
        except Exception as error:  # its module is not there, or raises while it is imported
            answer = IrtrackError(f"a worker process cannot read what it is to run: {type(error).__name__}: {error}")
        else:
            try:
                answer = run_group(group, limit_s, Board(numbers), reels)
            except Exception as error:
                answer = error
        try:
            pipe.send(answer)
        except (pickle.PicklingError, TypeError, AttributeError):
            pipe.send(IrtrackError(f"{type(answer).__name__}: {answer}"))
