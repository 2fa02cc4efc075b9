"""Rows or columns that are read through two amplifiers by turns."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.camera.noise_base import FrameContext, Steady, read_only
from irsim.types import Floats


class OddEven(Steady):
    """Even rows or columns lie above odd ones: two amplifiers whose offsets differ."""

    stationary: ClassVar[bool] = True

    ratio: Annotated[float, Field(ge=-1000, le=1000)] = 1.0
    """Half of what even ones lie above odd ones, in units of the camera's NETD; below 0 where they lie below."""
    along: Literal["rows", "columns"] = "rows"
    """Whether rows or columns take turns."""

    def pattern(self, frame_context: FrameContext) -> Floats:
        rows, columns = frame_context.shape
        return _turns((rows, 1) if self.along == "rows" else (1, columns), self.ratio)

    def spread(self, frame_context: FrameContext, fixed: bool) -> float:
        return self.ratio**2 if fixed else 0.0


@lru_cache(maxsize=8)
def _turns(shape: tuple[int, int], ratio: float) -> Floats:
    """`ratio` and its negative by turns, float32."""
    odd = np.arange(max(shape)).reshape(shape) % 2
    return read_only(np.where(odd, -ratio, ratio).astype(np.float32))
