"""Transmission faults: frames that are lost or arrive twice."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.config.base import NamedKind, Several, invalid
from irsim.config.quantities import Fraction, Index
from irsim.rng import uniforms
from irsim.types import Bools

MAX_ARRIVALS = 20_000_000
"""Largest number of frames that arrive: twice as many as a scenario may have."""

BLOCK = 1024
"""Frames per draw of random numbers."""


class FrameFault(NamedKind):
    """Transmission fault at listed frames and at random frames."""

    frames: Several[Index] = ()
    """Frames of the scenario at which the fault begins."""
    rate: Fraction = 0.0
    """Probability that the fault begins at a frame."""
    length_frames: Annotated[int, Field(ge=1, le=1000)] = 1
    """Number of consecutive frames affected each time."""

    @abstractmethod
    def copies(self, hit: Bools) -> npt.NDArray[np.intp]:
        """Return how many times each of n frames arrives, (n,): once unless `hit`, (n,), is True at this frame."""

    def hits(self, count: int, seed: int) -> Bools:
        """Return the mask of affected frames, (count,), from frame 0 on; the mask of a larger count begins with it."""
        begins = np.zeros(count, dtype=bool)
        listed = np.asarray(self.frames, dtype=np.int64)
        begins[listed[listed < count]] = True
        if self.rate > 0:
            begins |= _uniform(count, seed, self.name) < self.rate
        last = np.maximum.accumulate(np.where(begins, np.arange(count), -self.length_frames))
        hit: Bools = np.arange(count) - last < self.length_frames
        return hit


class Drop(FrameFault):
    """Frames that are lost; the times of the remaining frames show the gap."""

    def copies(self, hit: Bools) -> npt.NDArray[np.intp]:
        return np.where(hit, 0, 1)


class Duplicate(FrameFault):
    """Frames that arrive twice: the same picture and ground truth again, at the same time."""

    def copies(self, hit: Bools) -> npt.NDArray[np.intp]:
        return np.where(hit, 2, 1)


def arriving_frames(faults: Sequence[FrameFault], count: int, seed: int) -> Sequence[int]:
    """Return the indices of the frames that arrive, in order, out of the first `count` frames of a camera."""
    if not faults:
        return range(count)
    copies = np.ones(count, dtype=np.intp)
    for fault in faults:
        copies = np.minimum(copies * fault.copies(fault.hits(count, seed)), MAX_ARRIVALS + 1)
    if copies.sum() > MAX_ARRIVALS:
        raise invalid(f"more than {MAX_ARRIVALS} frames arrive; allowed: fewer faults", at=("camera", "faults"))
    return tuple(np.repeat(np.arange(count), copies).tolist())


def _uniform(count: int, seed: int, name: str) -> npt.NDArray[np.float64]:
    """Return a uniform number within 0..1 for each frame, (count,), the same for any count."""
    blocks = [uniforms(BLOCK, seed, "fault", name, block) for block in range(-(-count // BLOCK))]
    return np.concatenate(blocks)[:count]
