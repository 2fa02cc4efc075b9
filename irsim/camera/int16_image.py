"""Pictures of 16-bit words: what noise keeps from frame to frame, in half the memory of numbers.

A frame reads ten megabytes, and two processes that render side by side share caches that hold twice so much at most:
where both do not fit, a frame takes a third longer.
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
    """A picture (rows, cols) float32, finite, rounded to whole units (halves to even): without one, to 1/32767 of its
    greatest magnitude; what is beyond the least and the greatest word, within 2^31 of them, is that one."""
    if unit is None:
        most = float(cv2.norm(picture, cv2.NORM_INF))
        unit = most / GREATEST if most > NOTHING else 1.0
    values = np.asarray(cv2.addWeighted(picture, 1 / unit, picture, 0, 0, dtype=cv2.CV_16S), np.int16)
    values.flags.writeable = False
    return Words(values, unit)


def parts(picture: Floats, fine: float) -> list[Words]:
    """A picture (rows, cols) float32, finite, as the sum of one or two: of two where the unit of one, for what is far
    out, would be above `fine`."""
    whole = words(picture)
    return [whole] if whole.unit <= fine else [whole, words(picture - whole.numbers())]
