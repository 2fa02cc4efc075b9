"""Image buffers: 16-bit images that noise terms keep from frame to frame, and scratch memory for intermediate results.

Images kept as int16 take half the memory of float32. A frame reads about ten megabytes of them; if they do not fit into
the cache, as with two processes that share one, a frame takes a third longer.
"""

from __future__ import annotations

import threading
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats, read_only

INT16_MAX = 2**15 - 1

ZERO_MAGNITUDE = 1e-30
"""Greatest magnitude up to which an image counts as zero."""

_buffers = threading.local()


class Int16Image(NamedTuple):
    """Image of `values` (rows, cols) int16, read only, in multiples of `unit`."""

    values: npt.NDArray[np.int16]
    unit: float

    def to_float(self) -> Floats:
        """Return the image as float32."""
        return self.values * np.float32(self.unit)


def int16_image(image: Floats, unit: float | None = None) -> Int16Image:
    """Round an image (rows, cols) float32, finite, to whole units, halves to even.

    unit   1/32767 of the greatest magnitude by default; values beyond the range of int16 are clipped
    """
    if unit is None:
        largest = float(cv2.norm(image, cv2.NORM_INF))
        unit = largest / INT16_MAX if largest > ZERO_MAGNITUDE else 1.0
    values = np.asarray(cv2.addWeighted(image, 1 / unit, image, 0, 0, dtype=cv2.CV_16S), np.int16)
    return Int16Image(read_only(values), unit)


def int16_sum(image: Floats, finest: float) -> list[Int16Image]:
    """Return one or two int16 images that sum to an image (rows, cols) float32, finite.

    The second one holds the rounding error of the first, if the unit of the first is above `finest`.
    """
    whole = int16_image(image)
    return [whole] if whole.unit <= finest else [whole, int16_image(image - whole.to_float())]


def scratch(shape: tuple[int, int], use: str) -> Floats:
    """Return this thread's float32 buffer of a shape for the purpose `use`, valid until its next call.

    A fresh array of an image's size costs more in page faults than the arithmetic done in it.
    """
    buffers: dict[str, Floats] = _buffers.__dict__
    found = buffers.get(use)
    if found is None or found.shape != shape:
        found = buffers[use] = np.empty(shape, np.float32)
    return found
