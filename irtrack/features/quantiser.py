"""Quantisation of grey levels to the bins of a histogram."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from irsim.types import Frame, Image

Bins = npt.NDArray[np.intp]
Counts = Image | npt.NDArray[np.float32]
BinsRange = Literal["full", "first_frame"]

TAILS = (1.0, 99.0)
"""Percentiles that bound the grey levels of the first frame; beyond them lie dead pixels (up to 0.5 %) and noise peaks.
Chosen here."""
MARGIN = 0.1
"""Share of the range between `TAILS` added on both sides, for targets that grow warmer or colder; chosen here."""


@dataclass(frozen=True, slots=True)
class Quantiser:
    """Quantiser of grey levels to `bins` equal bins over [low, high) counts; levels outside go to the end bins."""

    low: float
    high: float
    bins: int

    def __call__(self, image: Image) -> Bins:
        """Return the bin of each pixel, floor((I - low) / ((high - low) / bins)) clipped to 0 .. bins-1."""
        return _table(self.low, self.high, self.bins, image.itemsize).take(image)

    def table(self, itemsize: int) -> npt.NDArray[np.uint16]:
        """Return the bin of each grey level that an unsigned integer of `itemsize` bytes can hold."""
        return _short_table(self.low, self.high, self.bins, itemsize)


@lru_cache(maxsize=16)
def _table(low: float, high: float, bins: int, itemsize: int) -> Bins:
    """Return the bin of each level. Its arguments are numbers, since the hash of a dataclass in the cache takes 3
    us."""
    cells = (np.arange(256**itemsize) - low) * (bins / (high - low))
    table: Bins = np.clip(cells, 0, bins - 1).astype(np.intp)
    return table


@lru_cache(maxsize=16)
def _short_table(low: float, high: float, bins: int, itemsize: int) -> npt.NDArray[np.uint16]:
    return _table(low, high, bins, itemsize).astype(np.uint16)


def contiguous(image: Image) -> Image:
    """Return the image as one C-contiguous block of memory."""
    whole: Image = np.ascontiguousarray(image)  # type: ignore[assignment]  # numpy's stubs lose the element type
    return whole


def full_range(bits: int, bins: int) -> Quantiser:
    """Return the quantiser of the whole range of `bits`; on 8 bits b(I) = floor(I / (256 / B)), as in the papers."""
    return Quantiser(0.0, float(2**bits), bins)


def levels_between(image: Counts, patch: Counts) -> tuple[float, float]:
    """Return the (low, high) counts that a frame and a patch of it span, each between its percentiles `TAILS`."""
    levels = np.concatenate([np.percentile(image, TAILS), np.percentile(patch, TAILS)])
    return float(levels.min()), float(levels.max())


def fitted_range(image: Image, patch: Image, bins: int) -> Quantiser:
    """Return the quantiser of the range of grey levels in a first frame and the target's patch, plus `MARGIN`.

    With the full range a low-contrast target and its background would share one bin. The patch has percentiles of its
    own, since a small hot target lies beyond those of the frame.
    """
    low, high = levels_between(image, patch)
    margin = max(MARGIN * (high - low), 0.5)
    return Quantiser(low - margin, high + margin, bins)


def first_quantiser(frame: Frame, patch: Image, bins: int, bins_range: BinsRange) -> Quantiser:
    """Return the quantiser that a tracker sets in its first frame and keeps."""
    return full_range(frame.bits, bins) if bins_range == "full" else fitted_range(frame.image, patch, bins)
