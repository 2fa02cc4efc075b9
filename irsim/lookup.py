"""Tables looked up by whole pictures."""

from __future__ import annotations

from typing import TypeVar, cast

import cv2
import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels

_CV2_TAKES_16_BITS = int(cv2.__version__.split(".")[0]) >= 5
"""OpenCV 4 has 8-bit tables only; numpy takes about twice the time of OpenCV 5 (it widens the indices)."""


Entry = TypeVar("Entry", np.uint8, np.float32)


def lookup(
    table: npt.NDArray[Entry], words: npt.NDArray[np.uint16], out: npt.NDArray[Entry] | None = None
) -> npt.NDArray[Entry]:
    """table[words]: table (65536,), words any shape; out a C-contiguous array of the table's type and that shape."""
    if COMPILED:
        out = np.empty(words.shape, table.dtype) if out is None else out
        kernels.lookup(table, np.ascontiguousarray(words), out)  # OpenCV's other threads would wait for more, busily
        return out
    if _CV2_TAKES_16_BITS and words.ndim == 2 and words.size:
        return cast(npt.NDArray[Entry], cv2.LUT(words, table.reshape(1, -1), dst=out))
    # mode: the default one would go through a buffer where `out` is given.
    return np.take(table, words, out=out, mode="clip")
