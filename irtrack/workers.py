"""Worker processes: how they begin, are watched and end with their parent, and results in the order of the work."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing.connection import wait
from time import monotonic
from typing import Any, Protocol, TypeVar

import cv2

from irsim.interrupts import beginning, interrupts_held
from irtrack.errors import IrtrackError

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

POLL_S = 0.05
"""How often a watched process is looked at: so much later than its limit it may be ended."""

_starting = threading.Lock()


class Map(Protocol):
    """Applies a function to items and gives the outcomes in their order, each as soon as it and those before are
    there; whoever stops listening spares what has not begun."""

    def __call__(self, function: Callable[[Item], Outcome], items: Sequence[Item]) -> Iterator[Outcome]: ...


@contextmanager
def in_order(jobs: int) -> Iterator[Map]:
    """A `Map` over `jobs` processes, or over this one. What is given to several must be picklable, and the calling
    script needs the guard ``if __name__ == "__main__"``."""
    if jobs == 1:
        with one_thread():
            yield lambda function, items: map(function, items)
        return
    context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
    with ProcessPoolExecutor(jobs, mp_context=context, **beginning(begin_worker)) as pool:

        def spread(function: Callable[[Item], Outcome], items: Sequence[Item]) -> Iterator[Outcome]:
            with interrupts_held():
                futures = [pool.submit(function, item) for item in items]
            try:
                for future in futures:
                    yield future.result()
            except BrokenProcessPool:
                raise IrtrackError("a worker process died; what was finished is kept, run it again to go on") from None
            finally:
                for future in futures:
                    future.cancel()

        try:
            yield spread
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV uses one thread within: times are of one thread."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def begin_worker() -> None:
    """What every worker does first: one thread, and an end with its parent."""
    cv2.setNumThreads(1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def how_it_ended(code: int | None) -> str:
    """A process's exit code in words: 'SIGKILL', 'exit status 1'."""
    if code is None or code >= 0:
        return f"exit status {code}"
    with suppress(ValueError):
        return signal.Signals(-code).name
    return f"signal {-code}"


class GoneError(Exception):
    """A watched process is gone.

    at        its board then
    overdue   it was ended, for it took too long;  moved  its board changed while it was: it may just have gone on
    how       how it ended, in words
    """

    def __init__(self, at: tuple[float, ...], overdue: bool, moved: bool, how: str) -> None:
        super().__init__(how)
        self.at, self.overdue, self.moved, self.how = at, overdue, moved, how


class Watched:
    """A process that answers what it is sent, and says on a board of numbers what it is at; the last of them is the
    `time.monotonic()` by which it must have gone on.

    It runs serve(pipe, board, *given), where `board` holds the numbers given here to begin with.
    """

    def __init__(self, serve: Callable[..., None], board: Sequence[float], *given: object) -> None:
        context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
        self._board = context.RawArray("d", board)
        with _starting, interrupts_held():
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=serve, args=(theirs, self._board, *given), daemon=True)
            self._process.start()
            theirs.close()

    def send(self, work: object) -> None:
        """GoneError where the process is; what pickle raises where the work cannot be sent."""
        try:
            self._pipe.send(work)
        except OSError:
            raise self._gone() from None

    def answer(self) -> Any:
        """What it answers; GoneError where it is gone, or had to be ended for it took too long."""
        while not self._pipe.poll(POLL_S):
            at = tuple(self._board)
            if monotonic() > at[-1]:
                self.kill()
                raise self._gone(overdue=True, moved=at != tuple(self._board))
        try:
            return self._pipe.recv()
        except (EOFError, OSError):
            raise self._gone() from None

    def _gone(self, overdue: bool = False, moved: bool = False) -> GoneError:
        self._process.join(1.0)  # the pipe ends before the process does
        code = self._process.exitcode
        self.kill()
        return GoneError(tuple(self._board), overdue, moved, how_it_ended(code))

    def kill(self) -> None:
        """End the process, whatever it is at."""
        self._process.kill()
        self._process.join()


def _end_with_parent() -> None:
    """A pool's worker would wait for work for ever after its parent was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
