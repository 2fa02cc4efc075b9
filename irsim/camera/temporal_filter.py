"""Temporal noise reduction of a camera core: a recursive filter that follows motion.

y[k] = y[k-1] + g (x[k] - y[k-1]), with g small where nothing moves and 1 where the picture changes (J. C. Brailean et
al., "Noise reduction filters for dynamic image sequences: a review", Proc. IEEE 83, 1995).

A frame is the same alone as in sequence: the filter restarts every W frames, and a frame is taken from the run that is
W to 2 W - 1 frames old. W is the warm-up, after which the start has a weight of exp(-6) = 0.25 % where nothing moves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim._native import COMPILED, kernels
from irsim.config.base import Part
from irsim.types import Counts, Floats, Image

WARM_UP_TIME_CONSTANTS = 6
_DETECTION_PX = 9
"""Pixels of the square over which changes are averaged: motion is larger than a pixel's noise."""


class TemporalFilter(Part):
    """Motion-adaptive recursive filter of counts.

    White noise of sigma 1 becomes sqrt(gain / (2 - gain)). With `motion_counts` six times a pixel's noise, noise does
    not count as motion.
    """

    gain: Annotated[float, Field(ge=0.02, le=1)] = 0.25
    """Weight of a new frame where nothing moves; 1 is off."""
    motion_counts: Annotated[float, Field(gt=0, le=65_535)] = 30.0
    """Mean change of 3x3 px, counts, at which a new frame replaces the filtered one; below it the weight is less."""

    @property
    def warm_up(self) -> int:
        """Number of frames after which the start of the filter has no visible effect."""
        return 1 if self.gain == 1 else math.ceil(WARM_UP_TIME_CONSTANTS / -math.log1p(-self.gain))

    def start(self, index: int) -> int:
        """Return the frame at which the run begins that gives frame `index`."""
        return max(0, (index // self.warm_up - 1) * self.warm_up)

    def step(self, filtered: Floats, counts: Counts) -> Floats:
        """Return the filtered frame after `filtered`, (rows, cols) float32, from the counts of a frame."""
        slope = (1 - self.gain) / (_DETECTION_PX * self.motion_counts)
        if COMPILED:
            out = np.empty(counts.shape, np.float32)
            kernels.recursive(filtered, np.ascontiguousarray(counts), counts.shape[1], self.gain, slope, out)
            return out
        change = counts.astype(np.float32) - filtered
        around = np.pad(change, 1, mode="edge")
        down = (around[:-2] + around[1:-1]) + around[2:]
        total = (down[:, :-2] + down[:, 1:-1]) + down[:, 2:]
        weight = np.float32(self.gain) + np.float32(slope) * np.abs(total)
        return np.asarray(filtered + np.minimum(weight, np.float32(1)) * change)


class FilterSequence:
    """Filtered frames of a sequence; a frame does not depend on the order of the calls."""

    def __init__(self, filter: TemporalFilter) -> None:
        self._filter = filter
        self._last: tuple[int, Mapping[int, Floats]] = (-1, {})
        """Last frame, and the filtered frames of its runs by their starts."""

    def frame(self, index: int, counts: Callable[[int], Image]) -> Floats:
        """Return frame `index`, (rows, cols) float32 counts; `counts` returns the counts of a frame by its index."""
        start = self._filter.start(index)
        last, runs = self._last  # read once: another thread may replace it
        if last > index or start not in runs:
            last, runs = start - 1, {}
        for k in range(last + 1, index + 1):
            runs = self._advance(runs, counts(k).astype(np.uint16, copy=False), k)
        self._last = index, runs
        return runs[start]

    def _advance(self, runs: Mapping[int, Floats], counts: Counts, index: int) -> Mapping[int, Floats]:
        """Return the two runs of frame `index`: the one that gives it, and the one that warms up."""
        filter = self._filter
        starts = {filter.start(index), index - index % filter.warm_up}
        following = {start: filter.step(runs[start], counts) for start in starts if start in runs}
        return {**following, index: counts.astype(np.float32)} if index in starts else following
