"""Faults on the way from the camera: frames that get lost, and frames that arrive twice."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.config.base import Family, NamedKind, Several
from irsim.config.quantities import Fraction, Index
from irsim.rng import bit_generator
from irsim.types import Bools

BLOCK = 1024
"""Frames whose chances are drawn in one go."""


class Fault(NamedKind):
    """Something that happens to frames on their way, at listed ones and by chance."""

    frames: Several[Index] = ()
    """The scenario's frames at which it happens."""
    rate: Fraction = 0.0
    """Chance that it begins at a frame, of each frame."""
    length_frames: Annotated[int, Field(ge=1, le=1000)] = 1
    """To how many frames in a row it happens, each time."""

    @abstractmethod
    def copies(self, hit: Bools) -> npt.NDArray[np.intp]:
        """(n,) how many of each frame arrive, where `hit` says to which of them it happens."""

    def hits(self, count: int, seed: int) -> Bools:
        """(count,) the frames, from 0 on, to which it happens. More frames change none of them."""
        begins = np.zeros(count, dtype=bool)
        listed = np.asarray(self.frames, dtype=np.int64)
        begins[listed[listed < count]] = True
        if self.rate > 0:
            begins |= _chances(count, seed, self.name) < self.rate
        last = np.maximum.accumulate(np.where(begins, np.arange(count), -self.length_frames))
        hit: Bools = np.arange(count) - last < self.length_frames
        return hit


class Drop(Fault):
    """Frames that do not arrive; the times of those that do tell of the gap."""

    def copies(self, hit: Bools) -> npt.NDArray[np.intp]:
        return np.where(hit, 0, 1)


class Duplicate(Fault):
    """Frames that arrive twice: the same picture and truth again, at the same time."""

    def copies(self, hit: Bools) -> npt.NDArray[np.intp]:
        return np.where(hit, 2, 1)


FAULTS = Family("fault", Fault, {"drop": Drop, "duplicate": Duplicate})
"""What may happen to frames."""


def arrivals(faults: Sequence[Fault], count: int, seed: int) -> Sequence[int]:
    """Of `count` frames of a camera those that arrive, in order."""
    if not faults:
        return range(count)
    copies = np.ones(count, dtype=np.intp)
    for fault in faults:
        copies *= fault.copies(fault.hits(count, seed))
    return tuple(np.repeat(np.arange(count), copies).tolist())


def _chances(count: int, seed: int, name: str) -> npt.NDArray[np.float64]:
    """(count,) independent numbers, even between 0 and 1: those of a frame are the same for any count."""
    words = [bit_generator(seed, "fault", name, block).random_raw(BLOCK) for block in range(-(-count // BLOCK))]
    return np.ldexp((np.concatenate(words)[:count] >> np.uint64(11)).astype(np.float64), -53)
