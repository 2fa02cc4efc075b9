"""The first-order autoregressive process of unit variance, any frame of which costs few draws."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels
from irsim.camera.bridge import Bridge
from irsim.camera.int16_image import Words, words
from irsim.camera.scratch import scratch
from irsim.rng import Address, kernel_arguments, normals
from irsim.types import Floats

FORGOTTEN = 100.0
"""-log of a correlation below any digit; the hyperbolic cosine of more than 710 is too large for a number."""

STATE_UNIT = 2.0**-12
"""What a state is rounded to, in its sigmas: words reach 8 of them, which one of 10^15 numbers would leave. What
departs from nothing by less in a step (drift of a thousand NETD within 10^6 s) departs some 6 % too far at first."""

State = npt.NDArray[np.int16]
"""The process in each of its elements, words that count STATE_UNIT, read only."""


class Process(Bridge[State]):
    """Unit AR(1) in each element of `shape`, (rows, cols), addressed by the seed, the words and the frame.

    Its bridge is Gauss-Markov: given x[k-d] and x[k+d], x[k] is normal with mean
    (x[k-d] + x[k+d]) / (2 cosh(decay d)) and variance tanh(decay d), which is the conditional law of an
    AR(1) process with rho = exp(-decay).
    """

    def __init__(self, decay: float, shape: tuple[int, int], seed: int, *address: str) -> None:
        super().__init__(decay)
        self.shape = shape
        self.seed = seed
        self.address = address

    def anchor(self, index: int) -> State:
        return state_of(normals(self.shape, self.seed, *self.address, index))

    def new(self, index: int) -> float:
        """Sigma of what is new in a frame and in no other one, which is drawn with all else that is: nothing in an even
        frame, as others are drawn from its state."""
        if self.period == 1:
            return 1.0
        return _midway(self.decay)[1] if index % 2 else 0.0

    def known(self, index: int) -> Sequence[Words]:
        """The rest of the frame: its state, or the two that it lies between, which count less."""
        if self.period == 1:
            return ()
        if index % 2 == 0:
            return [Words(self.frame(index), STATE_UNIT)]
        weight = _midway(self.decay)[0]
        return [Words(state, weight * STATE_UNIT) for state in self.beside(index)]

    def between(self, before: State, after: State, index: int, distance: int) -> State:
        return bridged(self.decay * distance, before, after, self.seed, *self.address, index)


def state_of(values: Floats) -> State:
    """Numbers (rows, cols) float32, in sigmas, as a state."""
    return words(values, STATE_UNIT).values


def numbers(state: State) -> Floats:
    """A state's numbers, float32, in sigmas."""
    return Words(state, STATE_UNIT).numbers()


def bridged(decay: float, before: State, after: State, seed: int, *address: Address) -> State:
    """A draw of the unit process given its states before and after, `decay` the -log of its correlation with each."""
    weight, spread = _midway(decay)
    if COMPILED:
        state = np.empty(before.shape, np.int16)
        kernels.bridge(*kernel_arguments(seed, *address), before, after, weight, spread / STATE_UNIT, state)
        state.flags.writeable = False
        return state
    mean = np.add(before, after, dtype=np.float32) * np.float32(weight)
    drawn = normals(before.shape, seed, *address, out=scratch(before.shape, "bridge"))
    return words(np.asarray(cv2.scaleAdd(drawn, spread / STATE_UNIT, mean, dst=mean)), 1.0).values


def _midway(decay: float) -> tuple[float, float]:
    """The weight of either state, and the sigma of what is new, midway between two."""
    return 0.5 / math.cosh(min(decay, FORGOTTEN)), math.sqrt(math.tanh(decay))
