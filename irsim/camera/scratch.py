"""Buffers that are kept: a fresh array of a picture's size costs more in page faults than the sums done in it."""

from __future__ import annotations

import threading

import numpy as np

from irsim.types import Floats

_kept = threading.local()


def scratch(shape: tuple[int, int], use: str) -> Floats:
    """This thread's float32 buffer of that shape for one use; what it holds lasts until the next call for it."""
    buffers: dict[str, Floats] = _kept.__dict__
    found = buffers.get(use)
    if found is None or found.shape != shape:
        found = buffers[use] = np.empty(shape, np.float32)
    return found
