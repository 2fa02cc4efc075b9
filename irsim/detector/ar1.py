"""Noise with memory: a first-order autoregressive process of its own in each pixel, row or column."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.compiled import COMPILED, kernels
from irsim.detector.base import Moment, Noise, Ratio, read_only
from irsim.detector.bridge import Bridge
from irsim.detector.response import Lines, Weighted
from irsim.detector.scratch import scratch
from irsim.detector.terms import Over, over
from irsim.detector.variance import Variance
from irsim.rng import Address, begun, normals
from irsim.types import Floats

FORGOTTEN = 100.0
"""-log of a correlation below any digit; the hyperbolic cosine of more than 710 is too large for a number."""


class Ar1(Noise):
    """x[k] = rho x[k-1] + sqrt(1 - rho^2) white[k] in each pixel, stationary from frame 0 on."""

    stationary: ClassVar[bool] = True

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""
    rho: Annotated[float, Field(ge=0, lt=1)] | None = None
    """Correlation of neighbouring frames (0 is white); or give time_constant_s."""
    time_constant_s: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Time in which correlation falls to 1/e, s; or give rho."""
    over: Over = "pixel"
    """What has a process of its own: each pixel, row or column, or the frame as a whole."""

    @model_validator(mode="after")
    def _one_way(self) -> Ar1:
        if (self.rho is None) == (self.time_constant_s is None):
            many = "neither is given" if self.rho is None else "both are given"
            raise PydanticCustomError(
                "one_way",
                "{many}; allowed: exactly one of rho and time_constant_s",
                {"many": many, "at": () if self.rho is None else ("time_constant_s",)},
            )
        return self

    def decay(self, rate_hz: float) -> float:
        """-log of the correlation of neighbouring frames (infinite where rho is 0)."""
        if self.time_constant_s is not None:
            return 1 / (rate_hz * self.time_constant_s)
        return -math.log(self.rho) if self.rho else math.inf

    def grain(self, moment: Moment) -> float:
        return self.ratio * self._memory(moment).new(moment.index) if self.over == "pixel" else 0.0

    def lines(self, moment: Moment) -> Lines | None:
        if self.over == "pixel" or not self.ratio:
            return None
        (rows, columns), level = moment.shape, self._memory(moment).frame(moment.index) * np.float32(self.ratio)
        if self.over == "column":
            return np.zeros(rows, np.float32), level.reshape(columns)
        return np.broadcast_to(level[:, 0], rows).copy(), np.zeros(columns, np.float32)

    def lasting(self, moment: Moment) -> Sequence[Weighted]:
        if self.over != "pixel" or not self.ratio:
            return ()
        return [(state, weight * self.ratio) for state, weight in self._memory(moment).known(moment.index)]

    def _memory(self, moment: Moment) -> Process:
        return _process(self.decay(moment.rate_hz), over(moment.shape, self.over), moment.seed, self.name)

    def share(self, moment: Moment, fixed: bool) -> Variance:
        whole = self.ratio**2
        return Variance(shared=whole) if self.over == "frame" else Variance(own=whole)


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str) -> Process:
    return Process(decay, shape, seed, "noise", name)


class Process(Bridge[Floats]):
    """Unit AR(1) in each element of `shape`, float32, addressed by the seed, the words and the frame.

    Its bridge is Gauss-Markov: given x[k-d] and x[k+d], x[k] is normal with mean
    (x[k-d] + x[k+d]) / (2 cosh(decay d)) and variance tanh(decay d), which is the conditional law of an
    AR(1) process with rho = exp(-decay).
    """

    def __init__(self, decay: float, shape: tuple[int, int], seed: int, *address: str) -> None:
        super().__init__(decay)
        self.shape = shape
        self.seed = seed
        self.address = address

    def anchor(self, index: int) -> Floats:
        return read_only(normals(self.shape, self.seed, *self.address, index))

    def new(self, index: int) -> float:
        """Sigma of what is new in a frame and in no other one, which is drawn with all else that is: nothing in an even
        frame, as others are drawn from its state."""
        if self.period == 1:
            return 1.0
        return _midway(self.decay)[1] if index % 2 else 0.0

    def known(self, index: int) -> Sequence[Weighted]:
        """The rest of the frame: its state, or the two that it lies between, times their weights."""
        if self.period == 1:
            return ()
        if index % 2 == 0:
            return [(self.frame(index), 1.0)]
        weight = _midway(self.decay)[0]
        return [(state, weight) for state in self.beside(index)]

    def between(self, before: Floats, after: Floats, index: int, distance: int) -> Floats:
        return bridged(self.decay * distance, before, after, self.seed, *self.address, index)


def bridged(decay: float, before: Floats, after: Floats, seed: int, *address: Address) -> Floats:
    """A draw of the unit process given its states before and after, `decay` the -log of its correlation with each."""
    weight, spread = _midway(decay)
    if COMPILED:
        state = np.empty(before.shape, np.float32)
        kernels.bridge(*begun(seed, *address), before, after, weight, spread, state)
        return read_only(state)
    mean = cv2.addWeighted(before, weight, after, weight, 0)
    rows, columns = before.shape
    drawn = normals(before.shape, seed, *address, out=scratch((rows, columns), "bridge"))
    return read_only(np.asarray(cv2.scaleAdd(drawn, spread, mean, dst=mean)))


def _midway(decay: float) -> tuple[float, float]:
    """The weight of either state, and the sigma of what is new, midway between two."""
    return 0.5 / math.cosh(min(decay, FORGOTTEN)), math.sqrt(math.tanh(decay))
