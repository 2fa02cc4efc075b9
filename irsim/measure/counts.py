"""Frames of a source as one array: what measurements are made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from irsim.errors import InputError
from irsim.types import Floats, Source

Progress = Callable[[int, int], None]
"""Called with the frames read so far, and how many there will be."""


class Timed(NamedTuple):
    """Frames that follow each other: counts (T, rows, columns), uint8 or uint16 as in their source; times (T,), s."""

    counts: npt.NDArray[np.integer]
    times: Floats


def read_counts(source: Source, wanted: range, progress: Progress | None = None) -> npt.NDArray[np.integer]:
    """Counts of the frames `wanted`, which follow each other: (T, rows, columns), uint8 or uint16 as in the source.

    InputError where the source has none of them.
    """
    return read_timed(source, wanted, progress).counts


def read_timed(source: Source, wanted: range, progress: Progress | None = None) -> Timed:
    """The same, with the times of the frames."""
    images, times = [], []
    for frame in source.frames("counts", wanted.start, wanted.stop):
        images.append(frame.image)
        times.append(frame.time)
        if progress is not None:
            progress(len(images), len(wanted))
    if not images:
        asked = f"{wanted.start}:{wanted.stop}"
        raise InputError(f"{source.name}: there are no frames {asked}; allowed: one or more of its {len(source)}")
    return Timed(np.stack(images), np.array(times, np.float64))
