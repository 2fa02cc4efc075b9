"""The first-order autoregressive process of unit variance, any frame of which costs few draws."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from irsim.compiled import COMPILED, kernels
from irsim.detector.base import read_only
from irsim.detector.bridge import Bridge
from irsim.detector.response import Weighted
from irsim.detector.scratch import scratch
from irsim.rng import Address, begun, normals
from irsim.types import Floats

FORGOTTEN = 100.0
"""-log of a correlation below any digit; the hyperbolic cosine of more than 710 is too large for a number."""


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
