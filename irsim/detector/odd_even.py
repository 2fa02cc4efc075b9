"""Rows or columns that are read through two amplifiers by turns."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from irsim.detector.base import Additive, Moment
from irsim.types import Floats


class OddEven(Additive):
    """Even rows or columns lie above odd ones: two amplifiers whose offsets differ."""

    ratio: Annotated[float, Field(ge=-1000, le=1000)] = 1.0
    """Half of what even ones lie above odd ones, in units of the camera's NETD; below 0 where they lie below."""
    along: Literal["rows", "columns"] = "rows"
    """Whether rows or columns take turns."""

    def pattern(self, moment: Moment) -> Floats:
        rows, columns = moment.shape
        count = rows if self.along == "rows" else columns
        turns = np.where(np.arange(count) % 2, -self.ratio, self.ratio).astype(np.float32)
        return turns[:, None] if self.along == "rows" else turns[None, :]

    def spread(self, moment: Moment, fixed: bool) -> float:
        return self.ratio**2 if fixed else 0.0
