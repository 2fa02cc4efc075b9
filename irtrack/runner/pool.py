"""A fixed number of workers that threads take turns with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Generic, Protocol, TypeVar


class Closable(Protocol):
    def close(self) -> None: ...


Each = TypeVar("Each", bound=Closable)


class Pool(Generic[Each]):
    """As many workers as there are jobs, each made by `make`, and each lent to one thread at a time."""

    def __init__(self, jobs: int, make: Callable[[], Each]) -> None:
        self._all = [make() for _ in range(jobs)]
        self._free: SimpleQueue[Each] = SimpleQueue()
        for each in self._all:
            self._free.put(each)

    @contextmanager
    def one(self) -> Iterator[Each]:
        """Lend a worker for the length of the block; waits until one is free."""
        found = self._free.get()
        try:
            yield found
        finally:
            self._free.put(found)

    def close(self) -> None:
        """Close all workers, also those that are lent."""
        for each in self._all:
            each.close()
