"""Noise with memory: a first-order autoregressive process of its own in each pixel, row or column."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.camera.int16_image import Words
from irsim.camera.noise_base import FrameContext, Noise, Ratio, read_only
from irsim.camera.process import Process, numbers
from irsim.camera.response import Lines
from irsim.camera.terms import Over, over
from irsim.camera.variance import Variance


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

    def grain(self, frame_context: FrameContext) -> float:
        return self.ratio * self._memory(frame_context).new(frame_context.index) if self.over == "pixel" else 0.0

    def lines(self, frame_context: FrameContext) -> Lines | None:
        if self.over == "pixel" or not self.ratio:
            return None
        rows, columns = frame_context.shape
        level = numbers(self._memory(frame_context).frame(frame_context.index)) * np.float32(self.ratio)
        if self.over == "column":
            return read_only(np.zeros(rows, np.float32)), read_only(level.reshape(columns))
        return np.broadcast_to(level[:, 0], rows), read_only(np.zeros(columns, np.float32))

    def lasting(self, frame_context: FrameContext) -> Sequence[Words]:
        if self.over != "pixel" or not self.ratio:
            return ()
        return [
            Words(state, unit * self.ratio) for state, unit in self._memory(frame_context).known(frame_context.index)
        ]

    def _memory(self, frame_context: FrameContext) -> Process:
        return _process(
            self.decay(frame_context.rate_hz), over(frame_context.shape, self.over), frame_context.seed, self.name
        )

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        whole = self.ratio**2
        return Variance(shared=whole) if self.over == "frame" else Variance(own=whole)


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str) -> Process:
    return Process(decay, shape, seed, "noise", name, "memory")
