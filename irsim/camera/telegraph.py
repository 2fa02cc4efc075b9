"""Pixels that jump between two levels, as electrons are caught and let go."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from irsim.camera.bridge import Bridge
from irsim.camera.noise_base import AT_ONCE
from irsim.rng import uniforms
from irsim.types import Bools, Floats

Address = tuple[int, str, str, str]

MOST = 1 << 16
"""Pixels that are drawn at once for all frames of a block: with all numbers on the way some 40 MB."""


class Telegraph:
    """Which of `count` pixels are on, each a Markov chain of its own: on and off, its mean stays in frames.

    Over d frames the chain forgets by exp(-d (1/on + 1/off)). Given the states d before and d after, the
    one between is on with odds P(on | before) P(after | on) to P(off | before) P(after | off). A bridge runs over
    every AT_ONCE-th frame; those between are drawn together.
    """

    def __init__(self, on: float, off: float, count: int, address: Address) -> None:
        self.ends = _Ends(on, off, count, address)
        self._kept: tuple[int, Bools] | None = None

    def frame(self, index: int) -> Bools:
        """(count,) at frame `index`; only to be read."""
        block, at = divmod(index, AT_ONCE)
        kept = self._kept  # once: another thread may put its own there
        if kept is None or kept[0] != block:
            kept = self._kept = block, self._drawn(block)
        return np.asarray(kept[1][at])

    def _drawn(self, block: int) -> Bools:
        """(AT_ONCE + 1, count): the frames of a block, and the first of the next one."""
        ends = self.ends
        states = np.empty((AT_ONCE + 1, ends.count), np.bool_)
        states[0], states[-1] = ends.frame(block), ends.frame(block + 1)
        for first in range(0, ends.count, MOST):
            self._fill(states[:, first : first + MOST], block, first)
        return states

    def _fill(self, states: Bools, block: int, first: int) -> None:
        """Put in the frames between those of the ends, for the pixels from `first` on."""
        count = states.shape[1]
        drawn = uniforms(AT_ONCE * count, *self.ends.address, "frames", block, first).reshape(AT_ONCE, count)
        distance = AT_ONCE // 2
        while distance:
            known, middle = states[:: 2 * distance], slice(distance, None, 2 * distance)
            states[middle] = self.ends.midway(known[:-1], known[1:], drawn[middle], distance)
            distance //= 2


class _Ends(Bridge[Bools]):
    """The states at the first frame of each block, by its number."""

    def __init__(self, on: float, off: float, count: int, address: Address) -> None:
        self.forgets = 1 / on + 1 / off
        super().__init__(self.forgets * AT_ONCE)
        self.share = on / (on + off)
        self.count = count
        self.address = address

    def anchor(self, index: int) -> Bools:
        return self._uniform(index) < self.share

    def between(self, before: Bools, after: Bools, index: int, distance: int) -> Bools:
        return self.midway(before, after, self._uniform(index), distance * AT_ONCE)

    def midway(self, before: Bools, after: Bools, drawn: Floats, frames: int) -> Bools:
        """The states so many frames after one and before another one; `drawn` is even over 0..1."""
        if_on, either = _odds(self.share, math.exp(-self.forgets * frames))
        ends = before.view(np.uint8) + (after.view(np.uint8) << 1)
        return np.asarray(drawn * either[ends] < if_on[ends])

    def _uniform(self, index: int) -> npt.NDArray[np.float64]:
        return uniforms(self.count, *self.address, "block", index)


@lru_cache(maxsize=32)
def _odds(share: float, kept: float) -> tuple[Floats, Floats]:
    """(4,) each: P(on | before) P(after | on), and the sum of it and P(off | before) P(after | off), where it is off
    both times, on before, on after, and on both times. share of time on; kept, what is not yet forgotten."""
    from_on, from_off = share + (1 - share) * kept, share * (1 - kept)
    if_on = np.outer([1 - from_on, from_on], [from_off, from_on]).ravel()
    return if_on, if_on + np.outer([1 - from_off, from_off], [1 - from_off, 1 - from_on]).ravel()
