"""Results in the order of the work, however many do it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Protocol, TypeVar

from irtrack.runner import one_thread

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")


class Map(Protocol):
    """Applies a function to items and gives the outcomes in their order, each as soon as it and those before are
    there; whoever stops listening spares what has not begun."""

    def __call__(self, function: Callable[[Item], Outcome], items: Sequence[Item]) -> Iterator[Outcome]: ...


@contextmanager
def in_order(jobs: int) -> Iterator[Map]:
    """A `Map` over so many threads, each of which is to wait for a process (`irtrack.runner.Watched`); one job is
    done by this thread."""
    if jobs == 1:
        with one_thread():
            yield lambda function, items: map(function, items)
        return
    with ThreadPoolExecutor(jobs) as pool:

        def spread(function: Callable[[Item], Outcome], items: Sequence[Item]) -> Iterator[Outcome]:
            futures = [pool.submit(function, item) for item in items]
            try:
                for future in futures:
                    yield future.result()
            finally:
                for future in futures:
                    future.cancel()

        yield spread
