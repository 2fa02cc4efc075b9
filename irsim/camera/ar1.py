"""Noise correlated in time: a first-order autoregressive process, AR(1), per pixel, row, column or frame.

A frame is the same alone as in sequence. The process is drawn at anchor frames, so far apart that they are independent
in practice. Frames between them are drawn by a Gauss-Markov bridge, which halves the distance in each step and leaves
no seam at the anchors.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Annotated, ClassVar, Generic, TypeVar

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim._native import COMPILED, kernels
from irsim.camera.buffers import Int16Image, int16_image, scratch
from irsim.camera.noise_base import FrameContext, Noise, NoiseVariance, Over, Ratio, element_shape
from irsim.camera.response import Lines
from irsim.rng import Address, kernel_arguments, normals
from irsim.types import Floats, read_only

ANCHOR_CORRELATION = 1e-6
"""Correlation below which frames are drawn independently of each other."""

LARGEST_DECAY = 100.0
"""Decay, -log of a correlation, beyond which this counts as 0; the hyperbolic cosine overflows above 710."""

STATE_UNIT = 2.0**-12
"""Unit of a state's integers, in sigmas. Int16 then reaches 8 sigmas, which one of 10^15 numbers exceeds. A drift that
changes by less than one unit per step (a thousand NETD within 10^6 s) is about 6 % too large at its beginning."""

State = npt.NDArray[np.int16]
"""Values of a process in each pixel, row or column, in multiples of STATE_UNIT, read only."""

AnyState = TypeVar("AnyState")


class MarkovBridge(ABC, Generic[AnyState]):
    """Markov process whose value at a frame can be drawn given its values at an earlier and a later frame."""

    @abstractmethod
    def between(self, before: AnyState, after: AnyState, index: int, distance: int) -> AnyState:
        """Draw the value at frame `index`, given the values `distance` frames before and after it."""

    def path(
        self, index: int, ends: Mapping[int, AnyState], kept: Mapping[int, AnyState], finest: int = 1
    ) -> dict[int, AnyState]:
        """Return the values, by frame, that are drawn while an interval is halved down to frame `index`; ends included.

        ends     value at `index` itself, or values at two frames around it, a power of two apart
        kept     values drawn in earlier calls
        finest   least distance between frames that are drawn
        """
        nodes, left = dict(ends), min(ends)
        distance = max(ends) - left
        while index not in nodes and distance > finest:
            distance //= 2
            middle = left + distance
            if middle in kept:
                nodes[middle] = kept[middle]
            else:
                nodes[middle] = self.between(nodes[left], nodes[middle + distance], middle, distance)
            if middle <= index:
                left = middle
        return nodes


class StationaryBridge(MarkovBridge[AnyState]):
    """Stationary Markov process with correlation exp(-decay d) over d frames.

    Anchors are frames `period` apart, drawn independently of each other. Frame k between two anchors is drawn from its
    neighbours at a distance d, the largest power of two that divides k; these are drawn likewise, up to the anchors.
    The values of the last call are cached: in sequence a frame costs one draw on average.
    """

    def __init__(self, decay: float) -> None:
        self.decay = decay
        self.period = 1
        while self.period * decay <= -math.log(ANCHOR_CORRELATION):
            self.period *= 2
        self._kept: dict[int, AnyState] = {}

    @abstractmethod
    def anchor(self, index: int) -> AnyState:
        """Draw the value at anchor frame `index` from the stationary distribution."""

    def frame(self, index: int) -> AnyState:
        """Return the process at frame `index`, read only."""
        return self._nodes(index, 1)[index]

    def neighbours(self, index: int) -> tuple[AnyState, AnyState]:
        """Return the values one frame before and after the odd frame `index`, for a period of 2 or more."""
        nodes = self._nodes(index, 2)
        return nodes[index - 1], nodes[index + 1]

    def _nodes(self, index: int, finest: int) -> Mapping[int, AnyState]:
        kept = self._kept  # read once: another thread may replace it
        left = index - index % self.period
        anchors = (left,) if left == index else (left, left + self.period)
        ends = {anchor: kept[anchor] if anchor in kept else self.anchor(anchor) for anchor in anchors}
        nodes = self._kept = self.path(index, ends, kept, finest)
        return nodes


class Ar1Process(StationaryBridge[State]):
    """AR(1) process of unit variance in each element of `shape`, (rows, cols), addressed by seed, `address` and frame.

    Given x[k-d] and x[k+d], x[k] is normal with mean (x[k-d] + x[k+d]) / (2 cosh(decay d)) and variance
    tanh(decay d): the conditional distribution of an AR(1) process with rho = exp(-decay).
    """

    def __init__(self, decay: float, shape: tuple[int, int], seed: int, *address: str) -> None:
        super().__init__(decay)
        self.shape = shape
        self.seed = seed
        self.address = address

    def anchor(self, index: int) -> State:
        return to_state(normals(self.shape, self.seed, *self.address, index))

    def innovation_sigma(self, index: int) -> float:
        """Return the sigma of the part of a frame's noise on which no other frame depends; 0 in even frames.

        The camera draws this part together with all other white noise.
        """
        if self.period == 1:
            return 1.0
        return _midpoint(self.decay)[1] if index % 2 else 0.0

    def known_part(self, index: int) -> Sequence[Int16Image]:
        """Return the rest of a frame's noise: its own state, or the weighted states before and after it."""
        if self.period == 1:
            return ()
        if index % 2 == 0:
            return [Int16Image(self.frame(index), STATE_UNIT)]
        weight = _midpoint(self.decay)[0]
        return [Int16Image(state, weight * STATE_UNIT) for state in self.neighbours(index)]

    def between(self, before: State, after: State, index: int, distance: int) -> State:
        return draw_between(self.decay * distance, before, after, self.seed, *self.address, index)


def to_state(values: Floats) -> State:
    """Round values (rows, cols) float32, in sigmas, to a state."""
    return int16_image(values, STATE_UNIT).values


def from_state(state: State) -> Floats:
    """Return a state's values, float32, in sigmas."""
    return Int16Image(state, STATE_UNIT).to_float()


def draw_between(decay: float, before: State, after: State, seed: int, *address: Address) -> State:
    """Draw the state of the unit-variance process midway between two; `decay` is -log of its correlation with each."""
    weight, sigma = _midpoint(decay)
    if COMPILED:
        state = np.empty(before.shape, np.int16)
        kernels.bridge(*kernel_arguments(seed, *address), before, after, weight, sigma / STATE_UNIT, state)
        return read_only(state)
    mean = np.add(before, after, dtype=np.float32) * np.float32(weight)
    drawn = normals(before.shape, seed, *address, out=scratch(before.shape, "bridge"))
    return int16_image(np.asarray(cv2.scaleAdd(drawn, sigma / STATE_UNIT, mean, dst=mean)), 1.0).values


def _midpoint(decay: float) -> tuple[float, float]:
    """Return the weight of either state in the mean midway between two, and the sigma about this mean."""
    return 0.5 / math.cosh(min(decay, LARGEST_DECAY)), math.sqrt(math.tanh(decay))


class Ar1(Noise):
    """AR(1) noise: x[k] = rho x[k-1] + sqrt(1 - rho²) white[k] in each element, stationary from frame 0 on."""

    stationary: ClassVar[bool] = True

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""
    rho: Annotated[float, Field(ge=0, lt=1)] | None = None
    """Correlation of neighbouring frames (0 is white noise); or give `time_constant_s`."""
    time_constant_s: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Time in which the correlation falls to 1/e, s; or give `rho`."""
    over: Over = "pixel"
    """Elements that have independent processes: pixels, rows or columns, or the frame as a whole."""

    @model_validator(mode="after")
    def _one_parameter(self) -> Ar1:
        if (self.rho is None) == (self.time_constant_s is None):
            many = "neither is given" if self.rho is None else "both are given"
            raise PydanticCustomError(
                "one_way",
                "{many}; allowed: exactly one of rho and time_constant_s",
                {"many": many, "at": () if self.rho is None else ("time_constant_s",)},
            )
        return self

    def decay(self, rate_hz: float) -> float:
        """Return -log of the correlation of neighbouring frames (infinite where rho is 0)."""
        if self.time_constant_s is not None:
            return 1 / (rate_hz * self.time_constant_s)
        return -math.log(self.rho) if self.rho else math.inf

    def temporal_sigma(self, frame: FrameContext) -> float:
        return self.ratio * self._process(frame).innovation_sigma(frame.index) if self.over == "pixel" else 0.0

    def line_noise(self, frame: FrameContext) -> Lines | None:
        if self.over == "pixel" or not self.ratio:
            return None
        rows, columns = frame.shape
        level = from_state(self._process(frame).frame(frame.index)) * np.float32(self.ratio)
        if self.over == "column":
            return read_only(np.zeros(rows, np.float32)), read_only(level.reshape(columns))
        return np.broadcast_to(level[:, 0], rows), read_only(np.zeros(columns, np.float32))

    def correlated_noise(self, frame: FrameContext) -> Sequence[Int16Image]:
        if self.over != "pixel" or not self.ratio:
            return ()
        return [Int16Image(state, unit * self.ratio) for state, unit in self._process(frame).known_part(frame.index)]

    def _process(self, frame: FrameContext) -> Ar1Process:
        return _process(self.decay(frame.rate_hz), element_shape(frame.shape, self.over), frame.seed, self.name)

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        variance = self.ratio**2
        return NoiseVariance(frame=variance) if self.over == "frame" else NoiseVariance(pixel=variance)

    def line_variance(self, frame: FrameContext) -> tuple[float, float]:
        variance = self.ratio**2
        return variance if self.over == "row" else 0.0, variance if self.over == "column" else 0.0


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str) -> Ar1Process:
    return Ar1Process(decay, shape, seed, "noise", name, "memory")
