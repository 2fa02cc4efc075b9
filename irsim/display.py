"""From counts to the 8-bit picture: automatic gain control (AGC)."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.kinds import Family, Kind
from irsim.lookup import lookup
from irsim.types import Image

Picture = npt.NDArray[np.uint8]

MID_GREY = 128
"""Grey of a picture that has one brightness only."""

Tail = Annotated[float, Field(ge=0, lt=0.5)]
Count = Annotated[int, Field(ge=0, le=65_535)]


class Agc(Kind):
    """A way from counts to 8 bits."""

    @abstractmethod
    def display(self, counts: Image, bits: int) -> Picture:
        """(rows, cols) uint8 picture of `counts` (uint8 or uint16, `bits` deep)."""


class Linear(Agc):
    """Stretched linearly between two counts of the frame itself, a share of its pixels left outside."""

    tails: Annotated[tuple[Tail, Tail], Field(strict=False)] = (0.005, 0.005)
    """Shares of the pixels that may be darker than black and brighter than white."""

    def display(self, counts: Image, bits: int) -> Picture:
        levels = 2**bits
        histogram = cv2.calcHist([counts], [0], None, [levels], [0, levels])
        below = np.cumsum(histogram.ravel(), dtype=np.float64)  # pixels up to and with each count
        # At most the first share is below `low`, at most the second above `high`.
        low = np.searchsorted(below, self.tails[0] * counts.size, side="right")
        high = np.searchsorted(below, (1 - self.tails[1]) * counts.size, side="left")
        return _apply(_stretch(int(low), int(high)), counts)


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

    def display(self, counts: Image, bits: int) -> Picture:
        return _apply(_stretch(self.low, 2**bits - 1 if self.high is None else self.high), counts)


class Plain(Agc):
    """No gain control: 8-bit counts as they are, the top 8 bits of deeper ones."""

    def display(self, counts: Image, bits: int) -> Picture:
        top: Image = np.minimum(counts >> max(bits - 8, 0), 255)
        return top.astype(np.uint8)


AGCS = Family("agc", Agc, {"linear": Linear, "fixed": Fixed, "none": Plain})
"""Ways from counts to 8 bits."""


def _stretch(low: int, high: int) -> Picture:
    """(65536,) grey of each count: 0 below low, 255 above high, linear between; MID_GREY where they are one."""
    greys = np.zeros(65_536, np.uint8)
    greys[low + 1 :] = 255
    if high > low:
        greys[low : high + 1] = np.rint(np.linspace(0, 255, high - low + 1))
    else:
        greys[low] = MID_GREY
    return greys


def _apply(greys: Picture, counts: Image) -> Picture:
    return lookup(greys, counts.astype(np.uint16, copy=False))
