"""Local contrast around another AGC: unsharp masking of counts, or histogram equalisation of the picture by tiles."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from irsim.camera.agc import Agc, Fixed, Linear, Picture, Plain, Plateau, Statistics
from irsim.config.base import Family
from irsim.types import Image

CURVES = Family(
    "agc",
    Agc,
    {
        "linear": Linear,
        "plateau": Plateau,
        "fixed": Fixed,
        "none": Plain,
    },
)
"""Kinds of AGC with one curve for the whole picture."""

Tiles = Annotated[int, Field(ge=1, le=64)]


class NestedAgc(Agc):
    """AGC that processes the counts or the picture of an inner AGC and shares its `memory`."""

    @property
    @abstractmethod
    def inner(self) -> Agc:
        """AGC whose counts or picture are processed."""

    def preprocess(self, counts: Image, bits: int) -> Image:
        """Return the counts that the inner AGC displays, from those of a frame."""
        return counts

    def postprocess(self, picture: Picture) -> Picture:
        """Return the processed picture, from the picture of the inner AGC."""
        return picture

    @property
    def memory(self) -> int:
        return self.inner.memory

    def fixed_range(self, bits: int) -> tuple[int, int] | None:
        return self.inner.fixed_range(bits)

    def display(self, counts: Image, bits: int) -> Picture:
        return self.postprocess(self.inner.display(self.preprocess(counts, bits), bits))

    def statistics(self, counts: Image, bits: int) -> Statistics:
        return self.inner.statistics(self.preprocess(counts, bits), bits)

    def picture(self, counts: Image, bits: int, statistics: Sequence[Statistics]) -> Picture:
        return self.postprocess(self.inner.picture(self.preprocess(counts, bits), bits, statistics))


class Clahe(NestedAgc):
    """Contrast-limited adaptive histogram equalisation of another AGC's picture: each tile has its own curve.

    Zuiderveld, "Contrast limited adaptive histogram equalization", Graphics Gems IV, 1994, as in OpenCV.
    """

    base: Annotated[Agc, CURVES] = Linear()
    """AGC whose picture is equalised; it has one curve for the whole picture."""
    clip_limit: Annotated[float, Field(ge=0, le=256)] = 3.0
    """Steepest slope of a tile's curve, grey levels per grey level of the base's picture. The clipped part is spread
    evenly over the curve and adds at most 1 to its slope. 0 is off."""
    tiles: Annotated[tuple[Tiles, Tiles], Field(strict=False)] = (8, 8)
    """Tiles across and down; between their centres the curve is interpolated."""

    @property
    def inner(self) -> Agc:
        return self.base

    def postprocess(self, picture: Picture) -> Picture:
        if self.clip_limit == 0:
            return picture
        return cv2.createCLAHE(self.clip_limit, self.tiles).apply(picture).astype(np.uint8, copy=False)


class Unsharp(NestedAgc):
    """Unsharp masking of the counts before another AGC: local detail is amplified.

    The result is f + amount (f - blurred f) for counts f and a Gaussian blur (Gonzalez & Woods, Digital Image
    Processing, "Unsharp masking and highboost filtering"). Counts are masked, as they hold detail that 8 bits lose.
    """

    base: Annotated[Agc, Family("agc", Agc, {**CURVES.kinds, "clahe": Clahe})] = Linear()
    """AGC that displays the result."""
    amount: Annotated[float, Field(ge=0, le=20)] = 1.0
    """Factor of the added difference; 0 is off."""
    sigma_px: Annotated[float, Field(ge=0.3, le=20)] = 2.0
    """Sigma of the blur, px; structures larger than a few sigmas are not amplified."""

    @property
    def inner(self) -> Agc:
        return self.base

    def preprocess(self, counts: Image, bits: int) -> Image:
        if self.amount == 0:
            return counts
        plain = counts.astype(np.float32)
        sharp = plain + self.amount * (plain - cv2.GaussianBlur(plain, (0, 0), self.sigma_px))
        clipped: Image = np.rint(np.clip(sharp, 0, 2**bits - 1)).astype(counts.dtype)
        return clipped
