"""Medians over the frames of a recording, without a copy of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

_BAND = 16384
"""Pixels of a frame that are looked at at once: all frames' are then near the processor."""


def median_of(frames: Sequence[npt.NDArray[Any]] | npt.NDArray[Any]) -> npt.NDArray[np.floating]:
    """Median (rows, columns) of frames, T of (rows, columns) or (T, rows, columns), finite: as `np.median` has it along
    the first axis.

    The least of those left is taken out by comparing whole pictures until the middle one is reached.
    """
    first = frames[0]
    kind = np.float64 if first.dtype.kind in "iu" else first.dtype
    found = np.empty(first.shape, kind)
    height = max(_BAND // first.shape[1], 1)
    below, middle = (len(frames) - 1) // 2, len(frames) // 2
    for top in range(0, first.shape[0], height):
        band = slice(top, top + height)
        left = [frame[band].copy() for frame in frames]
        least = np.empty_like(left[0])
        for place in range(middle + 1):
            for k in range(place + 1, len(left)):
                np.minimum(left[place], left[k], out=least)
                np.maximum(left[place], left[k], out=left[k])
                left[place], least = least, left[place]
        found[band] = left[middle] if below == middle else (left[below].astype(kind) + left[middle]) / 2
    return found
