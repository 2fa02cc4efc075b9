"""What processes that render one scenario work out for each other, such as clouds that all of them need."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]

ENTRIES = 4096
"""Of its index: 256 MiB of what it keeps most of, tiles of 64 KiB."""

HEAD = 8 * (1 + 3 * ENTRIES)
"""Bytes of the index: a count, then keys, beginnings and ends."""

NOBODY = 0
"""The key of an entry that has been written over."""

Kept = TypeVar("Kept", bound=np.generic)
Name = tuple[str | float, ...]


class Lock(Protocol):
    """One of multiprocessing."""

    def acquire(self, block: bool) -> bool: ...

    def release(self) -> None: ...


class Shelf:
    """Arrays by their names, the newest that find room. Until it is `opened` it keeps none.

    Nobody waits for anybody: who comes while another reads or writes, or has died of it, works for itself. What
    anybody gets is the same.
    """

    def __init__(self) -> None:
        self._rack: _Rack | None = None

    def open(self, memory: Bytes, lock: Lock) -> None:
        """From now on it is one with the shelves of all processes that have this memory, zeros at first, and lock."""
        self._rack = _Rack(memory, lock) if memory.size > HEAD else None

    @contextmanager
    def opened(self, memory: Bytes, lock: Lock) -> Iterator[None]:
        """It is open within."""
        self.open(memory, lock)
        rack = self._rack
        try:
            yield
        finally:
            if self._rack is rack:
                self._rack = None

    def kept(
        self, name: Name, shape: tuple[int, ...], dtype: type[Kept], make: Callable[[], npt.NDArray[Kept]]
    ) -> npt.NDArray[Kept]:
        """What `make` gives, an array of that shape and dtype: what another has put there, or made and put there."""
        rack = self._rack  # once: another thread may close it
        if rack is None:
            return make()
        key, found = _key(name), np.empty(shape, dtype)
        if rack.find(key, _bytes(found)):
            return found
        made = np.ascontiguousarray(make())
        rack.put(key, _bytes(made))
        return made


class _Rack:
    """Memory: an index, and bytes that are written round and round, over the oldest."""

    def __init__(self, memory: Bytes, lock: Lock) -> None:
        head = memory[:HEAD].view(np.int64)
        self._count = head[:1]
        self._keys, self._begins, self._ends = head[1:].reshape(3, ENTRIES)
        self._data = memory[HEAD:]
        self._lock = lock

    def find(self, key: int, out: Bytes) -> bool:
        """Whether there is what has that key; `out` is it, then."""
        if not self._lock.acquire(False):
            return False
        try:
            entries = np.flatnonzero(self._keys == key)
            if entries.size:
                out[:] = self._data[self._begins[entries[0]] : self._ends[entries[0]]]
            return bool(entries.size)
        finally:
            self._lock.release()

    def put(self, key: int, what: Bytes) -> None:
        """It stays until its room is needed; what would need most of all room is not kept."""
        if 2 * what.size > self._data.size or not self._lock.acquire(False):
            return
        try:
            entry = self._count[0] % ENTRIES
            begin = self._ends[entry - 1]
            if begin + what.size > self._data.size:
                begin = 0
            end = begin + what.size
            self._keys[(self._begins < end) & (self._ends > begin)] = NOBODY
            self._keys[entry] = NOBODY
            self._data[begin:end] = what
            self._begins[entry], self._ends[entry] = begin, end
            self._keys[entry] = key  # at last: who is interrupted before leaves nothing that others would find
            self._count += 1
        finally:
            self._lock.release()


def _bytes(array: npt.NDArray[np.generic]) -> Bytes:
    return array.reshape(-1).view(np.uint8)


def _key(name: Name) -> int:
    """Names of two things have two: but for one pair of a million names at odds of 1 to 37 million."""
    return int.from_bytes(hashlib.blake2b(repr(name).encode(), digest_size=8).digest(), "little", signed=True)
