"""Where worker processes put the pictures that they render, and find what others worked out: memory that all see.

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
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Kind = TypeVar("Kind", bound=np.generic)


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

    @property
    def bytes(self) -> npt.NDArray[np.uint8]:
        """All of it, (n,)."""
        return np.empty(0, np.uint8) if self._map is None else np.frombuffer(self._map, np.uint8)

    def picture(self, place: int, shape: tuple[int, int], dtype: type[Kind]) -> npt.NDArray[Kind] | None:
        """One of its pictures of a shape (rows, cols) and a dtype; None where it ends before."""
        rows, columns = shape
        size = rows * columns * np.dtype(dtype).itemsize
        part = self.bytes[place * size : (place + 1) * size]
        return part.view(dtype).reshape(shape) if part.size == size else None

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
def shared(size: int, at_once: bool = True) -> Iterator[Shared]:
    """Memory of `size` bytes, zeros, for processes that are started within the block; of none where there is none to be
    had. at_once: all of it is taken from the machine now, not page by page where it is written to."""
    with ExitStack() as ends:
        try:
            descriptor = _reserved(size, at_once)
            ends.callback(os.close, descriptor)
            memory = ends.enter_context(closing(Shared(descriptor, size)))
        except OSError:
            memory = Shared()
        yield memory


def _reserved(size: int, at_once: bool) -> int:
    """The descriptor of a nameless file of `size` bytes. OSError where there is none."""
    if sys.platform == "win32" or size == 0:
        raise OSError("no descriptors that processes inherit, or nothing to hold")
    descriptor = _nameless()
    try:
        os.truncate(descriptor, size)
        # Whoever writes where nothing is left is killed; a file on a disk may come to that.
        if hasattr(os, "posix_fallocate") and (at_once or not hasattr(os, "memfd_create")):
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
