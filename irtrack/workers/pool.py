"""As many of something as there are jobs, each for one thread at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Generic, Protocol, TypeVar


class Closable(Protocol):
    def close(self) -> None: ...


Each = TypeVar("Each", bound=Closable)


class Pool(Generic[Each]):
    """What `make` gives, so many times."""

    def __init__(self, jobs: int, make: Callable[[], Each]) -> None:
        self._all = [make() for _ in range(jobs)]
        self._free: SimpleQueue[Each] = SimpleQueue()
        for each in self._all:
            self._free.put(each)

    @contextmanager
    def one(self) -> Iterator[Each]:
        """One of them, which nobody else has within the block; waits for it."""
        found = self._free.get()
        try:
            yield found
        finally:
            self._free.put(found)

    def close(self) -> None:
        """All of them, those in use, too."""
        for each in self._all:
            each.close()
