"""Values handed from worker processes to their parent: what is large in them lies in memory that all of them see.

Through a pipe a picture is copied four times, half of them by the parent, which gets those of all workers.
"""

from __future__ import annotations

import mmap
import os
import pickle
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import reduction
from typing import Any


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

    def part(self, number: int, size: int) -> memoryview:
        """One of its parts of `size` bytes; an empty one where it has no bytes."""
        return memoryview(self._map or bytearray())[number * size : (number + 1) * size]

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


@dataclass(frozen=True)
class Parcel:
    """A value, pickled. Of each of its arrays the number of bytes, where they lie in a room one behind the other, or
    the bytes, where there was no place left."""

    pickled: bytes
    arrays: tuple[int | bytes, ...]


def pack(value: object, room: memoryview) -> Parcel:
    """A value whose arrays are put into a room, as far as they find place."""
    buffers: list[pickle.PickleBuffer] = []
    pickled = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    arrays: list[int | bytes] = []
    for raw in (buffer.raw() for buffer in buffers):
        if raw.nbytes > len(room):
            arrays.append(raw.tobytes())
            continue
        room[: raw.nbytes] = raw
        room = room[raw.nbytes :]
        arrays.append(raw.nbytes)
    return Parcel(pickled, tuple(arrays))


def unpack(parcel: Parcel, room: memoryview) -> Any:
    """The value, which has nothing to do with the room any more."""
    buffers = []
    for array in parcel.arrays:
        if isinstance(array, int):
            buffers.append(bytearray(room[:array]))
            room = room[array:]
        else:
            buffers.append(bytearray(array))
    return pickle.loads(parcel.pickled, buffers=buffers)
