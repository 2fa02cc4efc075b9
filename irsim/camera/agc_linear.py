"""Counts stretched linearly to greys."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.camera.agc import MID_GREY, Agc, Look, Picture, Pixels, Ranking, shown
from irsim.types import Image

Tail = Annotated[float, Field(ge=0, lt=0.5)]
Count = Annotated[int, Field(ge=0, le=65_535)]


class Linear(Ranking):
    """Stretched linearly between two counts of the frame itself, a share of its pixels left outside."""

    tails: Annotated[tuple[Tail, Tail], Field(strict=False)] = (0.005, 0.005)
    """Shares of the pixels that may be darker than black and brighter than white."""

    def asked(self, pixels: Pixels, size: int) -> Look:
        """(2,) the counts that become black and white."""
        below = np.cumsum(pixels)  # pixels up to and with each count
        # At most the first share is below `low`, at most the second above `high`.
        low = np.searchsorted(below, math.floor(self.tails[0] * size), side="right")
        high = np.searchsorted(below, math.ceil((1 - self.tails[1]) * size), side="left")
        return np.array([low, high], dtype=np.float64)

    def greys(self, look: Look, bits: int) -> Picture:
        return stretched(*look.tolist())


class Fixed(Agc):
    """Stretched linearly between two given counts: the picture's grey is comparable between frames."""

    low: Count = 0
    """Count that becomes black."""
    high: Count | None = None
    """Count that becomes white; the highest of the counts' depth where not given."""

    @model_validator(mode="after")
    def _rises(self) -> Fixed:
        if self.high is not None and self.low >= self.high:
            raise PydanticCustomError(
                "counts_rise",
                "low {low} is not below high {high}; allowed: low < high",
                {"low": self.low, "high": self.high, "at": ("low",)},
            )
        return self

    def ends(self, bits: int) -> tuple[int, int]:
        return self.low, 2**bits - 1 if self.high is None else self.high

    def display(self, counts: Image, bits: int) -> Picture:
        return shown(stretched(*self.ends(bits)), counts)


class Plain(Agc):
    """No gain control: 8-bit counts as they are, the top 8 bits of deeper ones."""

    def display(self, counts: Image, bits: int) -> Picture:
        top: Image = np.minimum(counts >> max(bits - 8, 0), 255)
        return top.astype(np.uint8)


def stretched(low: float, high: float) -> Picture:
    """(65536,) grey of each count: 0 below low, 255 above high, linear between; MID_GREY where they are one."""
    greys = np.zeros(65_536, np.uint8)
    first, last = math.ceil(low), math.floor(high)
    greys[last + 1 :] = 255
    if high > low:
        greys[first : last + 1] = np.rint((np.arange(first, last + 1) - low) * (255 / (high - low)))
    else:
        greys[first] = MID_GREY
    return greys
