"""What an AGC is: counts to 8 bits, at once or with a memory of the frames before."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim._native import COMPILED, kernels
from irsim.config.base import Kind
from irsim.rng import lookup
from irsim.types import Floats, Image

Picture = npt.NDArray[np.uint8]
Pixels = npt.NDArray[np.integer]
"""(2^bits,) number of pixels of each count."""
Look = npt.NDArray[np.float64]
"""What one frame alone asks of the curve from counts to greys: counts, which may be averaged over frames."""

MID_GREY = 128
"""Grey of a picture that has one brightness only."""

TIME_CONSTANTS = 10
"""How far an AGC's memory reaches, in time constants: what is older would weigh exp(-10) = 0.005 %, and
move no grey by one even after a scene of fifty times as wide a range."""

_NOTHING = np.empty(0)


class Agc(Kind):
    """A way from counts to 8 bits. One without memory has to say `display` only."""

    @property
    def memory(self) -> int:
        """How many frames before a frame its picture depends on."""
        return 0

    @abstractmethod
    def display(self, counts: Image, bits: int) -> Picture:
        """(rows, cols) uint8 picture of `counts` (uint8 or uint16, `bits` deep), as of a first frame."""

    def ends(self, bits: int) -> tuple[int, int] | None:
        """Counts, `bits` deep, that become black and white in every picture; None where they follow the scene."""
        return None

    def look(self, counts: Image, bits: int) -> Look:
        """What is kept of a frame for those after it, some numbers; the same number of them each time."""
        return _NOTHING

    def picture(self, counts: Image, bits: int, looks: Sequence[Look]) -> Picture:
        """The picture of a frame after others: `looks` at its `memory` predecessors, oldest first, and at itself.

        Near a sequence's beginning there are fewer.
        """
        return self.display(counts, bits)


class Adaptive(Agc):
    """An AGC whose curve follows the scene, at once or slowly."""

    time_constant_frames: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Time in which its curve follows a change of the scene to 1 - 1/e, frames; 0 is at once."""

    @property
    def memory(self) -> int:
        return math.ceil(TIME_CONSTANTS * self.time_constant_frames)

    @abstractmethod
    def look(self, counts: Image, bits: int) -> Look: ...

    @abstractmethod
    def greys(self, look: Look, bits: int) -> Picture:
        """(65536,) grey of each count, by a look or an average of looks."""

    def display(self, counts: Image, bits: int) -> Picture:
        return self.picture(counts, bits, [self.look(counts, bits)])

    def picture(self, counts: Image, bits: int, looks: Sequence[Look]) -> Picture:
        return shown(self.greys(faded(looks, self.time_constant_frames), bits), counts)


class Ranking(Adaptive):
    """An adaptive AGC to which a frame is how many of its pixels have each count, wherever they are."""

    def look(self, counts: Image, bits: int) -> Look:
        return self.asked(histogram(counts, bits), counts.size)

    @abstractmethod
    def asked(self, pixels: Pixels, size: int) -> Look:
        """A look by the pixels of each count, of `size` in all."""


def shown(greys: Picture, counts: Image) -> Picture:
    """The picture of counts by a table (65536,) of greys."""
    return lookup(greys, counts.astype(np.uint16, copy=False))


def histogram(counts: Image, bits: int) -> Pixels:
    """(2^bits,) number of pixels of each count; counts beyond are left out."""
    levels = 2**bits
    if COMPILED and counts.dtype == np.uint16:
        pixels = np.empty(levels, np.int64)
        kernels.histogram(np.ascontiguousarray(counts, np.uint16), pixels)
        return pixels
    return np.bincount(counts.ravel(), minlength=levels)[:levels].astype(np.int64, copy=False)


def faded(looks: Sequence[Look], time_constant: float) -> Look:
    """The mean of looks, oldest first, of weight exp(-age / time_constant), ages in frames.

    That is the first-order filter y_k = y_(k-1) + (1 - r) (x_k - y_(k-1)) with r = exp(-1 / time_constant),
    less what it would still know of frames older than the looks. As a sum over a window it is the same
    whoever asks, from wherever he starts; the filter itself would be so only after endless time.
    """
    if len(looks) == 1:
        return looks[0]
    weights = _weights(time_constant, len(looks))
    # Row after row, in this order on every machine: a matrix product may add in any.
    mean: Look = np.sum(np.stack(looks) * weights[:, np.newaxis], axis=0)
    return mean


@lru_cache(maxsize=256)
def _weights(time_constant: float, count: int) -> Floats:
    weights: Floats = np.exp(-np.arange(count)[::-1] / time_constant)
    weights /= weights.sum()
    return weights
