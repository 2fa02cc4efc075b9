"""A process with memory that begins at nothing."""

from __future__ import annotations

import math

import cv2
import numpy as np

from irsim.camera.bridge import Midways
from irsim.camera.process import State, bridged, numbers, state_of
from irsim.rng import normals


class Departure(Midways[State]):
    """AR(1) in each element of `shape`, (rows, cols), that is 0 in frame 0, addressed by the seed, the words and the
    frame: D[k] = rho D[k-1] + sqrt(1 - rho^2) white[k], of variance 1 - rho^(2k), rho = exp(-decay).

    Frames 1, 2, 4 and so on are each drawn from the one before in this list, those between two of them midway. The
    nodes on the way to the last frame are kept: in sequence a frame costs one draw on average. What is kept changes no
    result.
    """

    def __init__(self, decay: float, shape: tuple[int, int], seed: int, *address: str | int) -> None:
        self.decay = decay
        self.shape = shape
        self.seed = seed
        self.address = address
        self._kept: dict[int, State] = {}

    def frame(self, index: int) -> State:
        """The process at frame `index`, 0 or more; the caller must not write to it."""
        if index == 0:
            return np.zeros(self.shape, np.int16)
        kept = self._kept  # once: another thread may put its own there
        first = 1 << index.bit_length() - 1
        ends = {first: self._power(first, kept)}
        if index > first:
            ends[2 * first] = kept[2 * first] if 2 * first in kept else self._onward(ends[first], 2 * first, first)
        nodes = self._kept = self.way(index, ends, kept)
        return nodes[index]

    def between(self, before: State, after: State, index: int, distance: int) -> State:
        return bridged(self.decay * distance, before, after, self.seed, *self.address, index)

    def _power(self, index: int, kept: dict[int, State]) -> State:
        """The frame of a power of two."""
        if index in kept:
            return kept[index]
        if index == 1:
            return self._onward(self.frame(0), 1, 1)
        return self._onward(self._power(index // 2, kept), index, index // 2)

    def _onward(self, before: State, index: int, distance: int) -> State:
        """A draw of frame `index` given the one so far before it."""
        share, spread = math.exp(-self.decay * distance), math.sqrt(-math.expm1(-2 * self.decay * distance))
        drawn = normals(self.shape, self.seed, *self.address, index)
        return state_of(np.asarray(cv2.addWeighted(numbers(before), share, drawn, spread, 0, dst=drawn)))
