"""Pictures of 16-bit words: what noise keeps from frame to frame, in half the memory of numbers.

A frame reads some ten megabytes of it, and two processes that render side by side share caches that hold twice so much
at most: where they do not, a frame takes a third longer.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats

GREATEST = 2**15 - 1
"""The greatest word."""

NOTHING = 1e-30
"""A picture whose greatest magnitude is no more than this is all 0."""


class Words(NamedTuple):
    """A picture: `values` (rows, cols) int16, read only, each of which counts `unit`."""

    values: npt.NDArray[np.int16]
    unit: float

    def numbers(self) -> Floats:
        """What they stand for, float32."""
        return self.values * np.float32(self.unit)


def words(picture: Floats, unit: float | None = None) -> Words:
    """A picture (rows, cols) float32, rounded to whole units (halves to even): without one, to 1/65534 of twice its
    greatest magnitude; what is beyond the least and the greatest word is that one."""
    if unit is None:
        most = float(cv2.norm(picture, cv2.NORM_INF))
        unit = most / GREATEST if most > NOTHING else 1.0
    values = np.asarray(cv2.addWeighted(picture, 1 / unit, picture, 0, 0, dtype=cv2.CV_16S), np.int16)
    values.flags.writeable = False
    return Words(values, unit)
