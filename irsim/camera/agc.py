"""Automatic gain control (AGC): from counts to 8-bit pictures by one curve, adaptive or fixed.

An adaptive AGC follows the scene at once or with a time constant. Its curve comes from a weighted mean of the
statistics of the last frames. The window is finite, so that a frame has the same picture alone as in sequence.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim._native import COMPILED, kernels
from irsim.config.base import Kind
from irsim.rng import lookup
from irsim.types import Floats, Frame, Image

Picture = npt.NDArray[np.uint8]
Histogram = npt.NDArray[np.integer]
"""(2^bits,) number of pixels of each count."""
Statistics = npt.NDArray[np.float64]
"""Counts, (n,), that define the curve from counts to grey levels, for one frame or as a mean over frames."""

MID_GREY = 128
"""Grey level of a uniform picture."""

MEMORY_TIME_CONSTANTS = 10
"""Number of time constants in the window. Older frames would have a weight of exp(-10) = 0.005 %. They would change a
picture by less than a grey level, even if their range of counts were fifty times as large."""

_NO_STATISTICS = np.empty(0)


class Agc(Kind):
    """Mapping of counts to 8-bit grey levels. A kind that depends on no earlier frames overrides `display` only."""

    @property
    def memory(self) -> int:
        """Number of earlier frames that a picture depends on."""
        return 0

    @abstractmethod
    def display(self, counts: Image, bits: int) -> Picture:
        """Return the picture, (rows, cols) uint8, of `counts`, `bits` deep, as the first frame of a sequence."""

    def fixed_range(self, bits: int) -> tuple[int, int] | None:
        """Return the counts shown as black and as white; None if they change with the scene."""
        return None

    def statistics(self, counts: Image, bits: int) -> Statistics:
        """Return the statistics (n,) of a frame, from which the tone curves of this and later frames are computed."""
        return _NO_STATISTICS

    def picture(self, counts: Image, bits: int, statistics: Sequence[Statistics]) -> Picture:
        """Return the picture of a frame in a sequence.

        statistics   those of the `memory` frames before it, oldest first, and its own; fewer at the start of a sequence
        """
        return self.display(counts, bits)

    def processed(self, bits: int) -> Callable[[int, Callable[[int], Image]], Image] | None:
        """Return a function from a frame's index, and a function that returns counts by index, to the counts that
        `statistics` and `picture` take; None where these are the frame's own. It may depend on earlier frames."""
        return None

    def delivered(self) -> Callable[[int, Callable[[int], Picture]], Picture] | None:
        """Return a function from a frame's index, and a function that returns pictures by index, to the picture
        that leaves the camera; None where this is the picture itself. It may depend on earlier frames."""
        return None


class AdaptiveAgc(Agc):
    """AGC whose curve follows the scene, at once or with a time constant."""

    time_constant_frames: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Time constant with which the curve follows a change of the scene, frames; 0 is at once."""

    @property
    def memory(self) -> int:
        return math.ceil(MEMORY_TIME_CONSTANTS * self.time_constant_frames)

    @abstractmethod
    def statistics(self, counts: Image, bits: int) -> Statistics: ...

    @abstractmethod
    def curve(self, statistics: Statistics, bits: int) -> Picture:
        """Return the grey level of each count, (65536,), for the statistics of a frame or their mean over frames."""

    def display(self, counts: Image, bits: int) -> Picture:
        return self.picture(counts, bits, [self.statistics(counts, bits)])

    def picture(self, counts: Image, bits: int, statistics: Sequence[Statistics]) -> Picture:
        return apply_curve(self.curve(weighted_mean(statistics, self.time_constant_frames), bits), counts)


class HistogramAgc(AdaptiveAgc):
    """Adaptive AGC that depends on the histogram of a frame only."""

    def statistics(self, counts: Image, bits: int) -> Statistics:
        return self.histogram_statistics(histogram(counts, bits), counts.size)

    @abstractmethod
    def histogram_statistics(self, pixels: Histogram, size: int) -> Statistics:
        """Return the statistics of a frame of `size` pixels from its histogram."""


def apply_curve(curve: Picture, counts: Image) -> Picture:
    """Return the picture of counts by a table (65536,) of grey levels."""
    return lookup(curve, counts.astype(np.uint16, copy=False))


def histogram(counts: Image, bits: int) -> Histogram:
    """Return the number of pixels of each count, (2^bits,); counts beyond the bit depth are left out."""
    levels = 2**bits
    if COMPILED and counts.dtype == np.uint16:
        pixels = np.empty(levels, np.int64)
        kernels.histogram(np.ascontiguousarray(counts, np.uint16), pixels)
        return pixels
    return np.bincount(counts.ravel(), minlength=levels)[:levels].astype(np.int64, copy=False)


def weighted_mean(statistics: Sequence[Statistics], time_constant: float) -> Statistics:
    """Return the mean of statistics, oldest first, with weights exp(-age / time_constant), ages in frames.

    The mean is the first-order filter y[k] = y[k-1] + (1 - r) (x[k] - y[k-1]), r = exp(-1 / time_constant), truncated
    to the window. A recursive filter would depend on the frame at which reading starts.
    """
    if len(statistics) == 1:
        return statistics[0]
    weights = _weights(time_constant, len(statistics))
    # Row after row, in the same order on every machine: a matrix product may add in any order.
    mean: Statistics = np.sum(np.stack(statistics) * weights[:, np.newaxis], axis=0)
    return mean


@lru_cache(maxsize=256)
def _weights(time_constant: float, count: int) -> Floats:
    weights: Floats = np.exp(-np.arange(count)[::-1] / time_constant)
    weights /= weights.sum()
    return weights


# Linear curves

Tail = Annotated[float, Field(ge=0, lt=0.5)]
Count = Annotated[int, Field(ge=0, le=65_535)]


class Linear(HistogramAgc):
    """Linear stretch between two quantiles of the frame."""

    tails: Annotated[tuple[Tail, Tail], Field(strict=False)] = (0.005, 0.005)
    """Shares of the pixels that may be darker than black and brighter than white."""

    def histogram_statistics(self, pixels: Histogram, size: int) -> Statistics:
        """Return the counts that become black and white, (2,)."""
        below = np.cumsum(pixels)  # pixels up to and including each count
        # At most tails[0] of the pixels are below `low`, at most tails[1] above `high`.
        low = np.searchsorted(below, math.floor(self.tails[0] * size), side="right")
        high = np.searchsorted(below, math.ceil((1 - self.tails[1]) * size), side="left")
        return np.array([low, high], dtype=np.float64)

    def curve(self, statistics: Statistics, bits: int) -> Picture:
        return linear_curve(*statistics.tolist())


class Fixed(Agc):
    """Linear stretch between two given counts: grey levels are comparable between frames."""

    low: Count = 0
    """Count that becomes black."""
    high: Count | None = None
    """Count that becomes white; by default the highest count of the bit depth."""

    @model_validator(mode="after")
    def _low_below_high(self) -> Fixed:
        if self.high is not None and self.low >= self.high:
            raise PydanticCustomError(
                "counts_rise",
                "low {low} is not below high {high}; allowed: low < high",
                {"low": self.low, "high": self.high, "at": ("low",)},
            )
        return self

    def fixed_range(self, bits: int) -> tuple[int, int]:
        return self.low, 2**bits - 1 if self.high is None else self.high

    def display(self, counts: Image, bits: int) -> Picture:
        return apply_curve(linear_curve(*self.fixed_range(bits)), counts)


class Plain(Agc):
    """No gain control: 8-bit counts are unchanged, deeper counts give their top 8 bits."""

    def display(self, counts: Image, bits: int) -> Picture:
        top: Image = np.minimum(counts >> max(bits - 8, 0), 255)
        return top.astype(np.uint8)


def linear_curve(low: float, high: float) -> Picture:
    """Return the grey level of each count, (65536,): 0 below `low`, 255 above `high`, MID_GREY where both meet."""
    curve = np.zeros(65_536, np.uint8)
    first, last = math.ceil(low), math.floor(high)
    curve[last + 1 :] = 255
    if high > low:
        curve[first : last + 1] = np.rint((np.arange(first, last + 1) - low) * (255 / (high - low)))
    else:
        curve[first] = MID_GREY
    return curve


# Plateau equalisation

_THRESHOLDS = np.arange(1, 256) - 0.5
"""Lowest values of the curve that round to the grey levels 1 to 255."""

_NO_LIMIT = 2 * 255.0
"""Gain limit that no curve reaches, grey levels per count; it stands for no limit."""


class Plateau(HistogramAgc):
    """Plateau equalisation: the slope at a count is proportional to its number of pixels, up to a plateau.

    With p(x) pixels of count x and the plateau T, the curve rises from one count to the next by d(x) = 255 min(p(x), T)
    / sum min(p, T), the darkest count left out of the sum, as the curve begins there (Vickers, "Plateau equalization
    algorithm for real-time display of high-quality infrared imagery", Opt. Eng. 35, 1996). The gain limit G reduces
    d(x) to min(d(x), G); of the grey levels left unused, half are dark and half bright.
    """

    plateau: Annotated[float, Field(ge=1e-6, le=1)] = 0.001
    """Plateau T, a share of the pixels. 1 is histogram equalisation; towards 0 all counts that occur weigh the same
    (histogram projection)."""
    gain_limit: Annotated[float, Field(ge=0.001, le=255)] | None = 2.0
    """Largest rise of the curve from one count to the next, grey levels. It limits the visible noise of a uniform
    scene; null sets no limit."""

    def histogram_statistics(self, pixels: Histogram, size: int) -> Statistics:
        """Return the count at which each grey level above black begins, (255,).

        Beyond the counts that occur, the curve rises by the gain limit.
        """
        weights = np.minimum(pixels, self.plateau * size)
        present = np.flatnonzero(weights)
        if not present.size:  # all counts are beyond the bit depth
            return np.full(255, float(pixels.size))
        first, last = int(present[0]), int(present[-1])
        gain = _NO_LIMIT if self.gain_limit is None else self.gain_limit
        rises = weights[first : last + 1]
        rises[0] = 0
        if first < last:
            rises = np.minimum(rises * (255 / rises.sum()), gain)
        curve = np.cumsum(rises)
        dark = (255 - curve[-1]) / 2
        curve += dark
        begins = first + np.searchsorted(curve, _THRESHOLDS).astype(np.float64)
        darker, brighter = curve[0] > _THRESHOLDS, curve[-1] < _THRESHOLDS
        begins[darker] = first - (dark - _THRESHOLDS[darker]) / gain
        begins[brighter] = last + (_THRESHOLDS[brighter] - curve[-1]) / gain
        return begins

    def curve(self, statistics: Statistics, bits: int) -> Picture:
        levels = 2**bits
        curve = np.full(65_536, 255, np.uint8)
        first_counts = np.clip(np.ceil(statistics), 0, levels).astype(np.int64)
        curve[:levels] = np.cumsum(np.bincount(first_counts, minlength=levels + 1)[:levels])
        return curve


class AgcSequence:
    """8-bit pictures of a sequence of frames; a picture does not depend on the order of the calls.

    A frame's picture depends on the statistics of its predecessors. These are cached while frames come in order.
    Missing ones are computed from `counts`, a function that returns the counts of a frame by its index.
    """

    def __init__(self, agc: Agc, bits: int, counts: Callable[[int], Image]) -> None:
        self._agc = agc
        self._bits = bits
        self._counts = counts
        self._statistics: dict[int, Statistics] = {}
        self._processed = agc.processed(bits)
        self._delivered = agc.delivered()

    def picture(self, counts: Image, index: int) -> Picture:
        """Return the picture of frame `index`, whose counts are given."""

        def known(k: int) -> Image:
            return counts if k == index else self._counts(k)

        if self._delivered is None:
            return self._picture(index, known)
        return self._delivered(index, lambda k: self._picture(k, known))

    def _picture(self, index: int, known: Callable[[int], Image]) -> Picture:
        """Return the picture of frame `index` as the gain control gives it; `known` returns the counts of a frame."""
        agc, bits = self._agc, self._bits
        if agc.memory == 0 and self._processed is None:
            return agc.display(known(index), bits)
        kept = self._statistics  # read once: another thread may replace it
        found = {}
        for k in range(max(0, index - agc.memory), index + 1):
            if k in kept and k < index:
                found[k] = kept[k]
            else:
                counts = known(k) if self._processed is None else self._processed(k, known)
                found[k] = agc.statistics(counts, bits)
        self._statistics = found
        return agc.picture(counts, bits, list(found.values()))

    def display(self, frame: Frame) -> Frame:
        """Return a frame of counts as a frame that holds its 8-bit picture."""
        return Frame(self.picture(frame.image, frame.index), frame.index, frame.time, 8)
