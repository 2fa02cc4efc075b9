"""Where worker processes put the pictures that they render: memory that their parent sees, too.

Through a pipe a picture is copied four times, half of them by the parent, which gets those of all workers.
"""

from __future__ import annotations

import mmap
import os
import sys
import tempfile
import weakref
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from multiprocessing import reduction
from typing import Any

import numpy as np

from irsim.types import Counts

COUNT_BYTES = 2

LENT = 4
"""Pictures that programs may have where workers put them. Who keeps more gets copies: the places are needed."""


class Shared:
    """Memory of a process and of those that it starts, which get it as an argument. It has no name: nothing is left of
    it when they end, however they do."""

    def __init__(self, descriptor: int | None = None, size: int = 0) -> None:
        self._descriptor = descriptor  # the caller's to close
        self._map = None if descriptor is None else mmap.mmap(descriptor, size)

    def __reduce__(self) -> tuple[Callable[..., Shared], tuple[Any, ...]]:
        if self._descriptor is None or self._map is None:
            return Shared, ()
        return _inherited, (reduction.DupFd(self._descriptor), len(self._map))

    def picture(self, place: int, shape: tuple[int, int]) -> Counts | None:
        """One of its pictures of a shape (rows, cols); None where it ends before."""
        rows, columns = shape
        size = rows * columns * COUNT_BYTES
        if self._map is None or (place + 1) * size > len(self._map):
            return None
        return np.frombuffer(self._map, np.uint16, rows * columns, place * size).reshape(shape)

    def close(self) -> None:
        """It is given back, as soon as nobody looks at a part of it."""
        if self._map is not None:
            with suppress(BufferError):
                self._map.close()


def _inherited(inherited: Any, size: int) -> Shared:
    descriptor = inherited.detach()
    memory = Shared(descriptor, size)
    os.close(descriptor)  # what is mapped needs it no more
    return memory


@contextmanager
def shared(size: int) -> Iterator[Shared]:
    """Memory of `size` bytes for processes that are started within the block; of none where there is none to be had."""
    with ExitStack() as ends:
        try:
            descriptor = _reserved(size)
            ends.callback(os.close, descriptor)
            memory = ends.enter_context(closing(Shared(descriptor, size)))
        except OSError:
            memory = Shared()
        yield memory


def _reserved(size: int) -> int:
    """The descriptor of a nameless file of `size` bytes. OSError where there is none."""
    if sys.platform == "win32" or size == 0:
        raise OSError("no descriptors that processes inherit, or nothing to hold")
    descriptor = _nameless()
    try:
        os.truncate(descriptor, size)
        if hasattr(os, "posix_fallocate"):  # all of it, now: whoever writes where nothing is left is killed
            os.posix_fallocate(descriptor, 0, size)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _nameless() -> int:
    if hasattr(os, "memfd_create"):
        return os.memfd_create("irsim")  # not in /dev/shm, which is small in containers
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


class Places:
    """Places in shared memory, of one picture each: free, with a worker, or of a picture that somebody has."""

    def __init__(self, memory: Shared, shape: tuple[int, int], count: int) -> None:
        self._memory = memory
        self._shape = shape
        self._free = list(reversed(range(count)))  # those that memory may not reach are taken last
        self._lent: set[int] = set()

    def taken(self, count: int) -> list[int]:
        """So many of them for a worker, first what was given back last; none where not as many are free."""
        return [self._free.pop() for _ in range(count)] if len(self._free) >= count else []

    def fetched(self, place: int) -> Counts | None:
        """What a worker has put into a place, which is free again when nobody has the picture any more; where LENT are
        out, a copy. None where there is no memory: it comes by the pipe."""
        picture = self._memory.picture(place, self._shape)
        if picture is None or len(self._lent) >= LENT:
            self._free.append(place)
            return None if picture is None else picture.copy()
        self._lent.add(place)
        root = picture.base  # what all views of it have in common
        weakref.finalize(root, self._given_back, place).atexit = False
        return picture

    def _given_back(self, place: int) -> None:
        self._lent.discard(place)
        self._free.append(place)
