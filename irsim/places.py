"""Where worker processes put the pictures that they render: memory that their parent sees, too.

Through a pipe a picture is copied four times, half of them by the parent, which gets those of all workers.
"""

from __future__ import annotations

import mmap
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from multiprocessing import reduction
from typing import Any

import numpy as np

from irsim.types import Counts

COUNT_BYTES = 2


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
