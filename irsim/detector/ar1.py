"""Noise with memory: a first-order autoregressive process of its own in each pixel."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.detector.base import Noise, Ratio
from irsim.rng import normals
from irsim.types import Floats

ANCHOR_CORRELATION = 1e-6
"""Frames whose correlation is below this are drawn independently of each other."""


class Ar1(Noise):
    """x[k] = rho x[k-1] + sqrt(1 - rho^2) white[k] in each pixel, stationary from frame 0 on."""

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""
    rho: Annotated[float, Field(ge=0, lt=1)] | None = None
    """Correlation of neighbouring frames (0 is white); or give time_constant_s."""
    time_constant_s: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Time in which correlation falls to 1/e, s; or give rho."""

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

    def pattern(self, index: int, shape: tuple[int, int], rate_hz: float, seed: int) -> Floats:
        process = _process(self.decay(rate_hz), shape, seed, self.name)
        return process.frame(index) * np.float32(self.ratio)


@lru_cache(maxsize=4)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str) -> _Process:
    return _Process(decay, shape, seed, name)


class _Process:
    """Unit AR(1) in each pixel, any frame of which costs O(log period) draws.

    Every `period` frames stands an anchor, independent of the others. Between two anchors runs a
    Gauss-Markov bridge: given x[k-d] and x[k+d], x[k] is normal with mean
    (x[k-d] + x[k+d]) / (2 cosh(decay d)) and variance tanh(decay d), which is the conditional law of
    an AR(1) process with rho = exp(-decay). So frame k is drawn from its two neighbours at a distance
    d = the largest power of two that divides k, they from theirs, up to the anchors. The nodes on
    the way to the last frame are kept: in sequence a frame costs one draw on average. What is kept
    changes no result.
    """

    def __init__(self, decay: float, shape: tuple[int, int], seed: int, name: str) -> None:
        self.decay = decay
        self.shape = shape
        self.seed = seed
        self.name = name
        self.period = 1
        while self.period * decay <= -math.log(ANCHOR_CORRELATION):
            self.period *= 2
        self._kept: dict[int, Floats] = {}

    def frame(self, index: int) -> Floats:
        """Frame `index`, `shape` float32, read-only."""
        nodes: dict[int, Floats] = {}
        distance = self.period
        left = index - index % distance
        for anchor in (left,) if left == index else (left, left + distance):
            nodes[anchor] = self._kept[anchor] if anchor in self._kept else self._draw(anchor)
        while index not in nodes:
            distance //= 2
            middle = left + distance
            if middle in self._kept:
                nodes[middle] = self._kept[middle]
            else:
                nodes[middle] = self._between(nodes[left], nodes[middle + distance], middle, distance)
            if middle <= index:
                left = middle
        self._kept = nodes
        return nodes[index]

    def _between(self, before: Floats, after: Floats, index: int, distance: int) -> Floats:
        weight = 0.5 / math.cosh(self.decay * distance)
        spread = math.sqrt(math.tanh(self.decay * distance))
        mean = cv2.addWeighted(before, weight, after, weight, 0)
        return _read_only(np.asarray(cv2.scaleAdd(self._draw(index), spread, mean, dst=mean)))

    def _draw(self, index: int) -> Floats:
        return _read_only(normals(self.shape, self.seed, "noise", self.name, index))


def _read_only(values: Floats) -> Floats:
    values.flags.writeable = False
    return values
