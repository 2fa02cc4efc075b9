"""Worker processes: how they begin, how they end with their parent, and results in the order of the work."""

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
from typing import Protocol, TypeVar

import cv2

from irsim.interrupts import beginning, interrupts_held
from irtrack.errors import IrtrackError

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


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


def _end_with_parent() -> None:
    """A pool's worker would wait for work for ever after its parent was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
