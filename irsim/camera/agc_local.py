"""Detail brought out, around another AGC: before it, from the counts, or behind it, in its picture."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from irsim.camera.agc import Agc, Look, Picture
from irsim.camera.agc_linear import Fixed, Linear, Plain
from irsim.camera.agc_plateau import Plateau
from irsim.config.base import Family
from irsim.types import Image

CURVES = Family("agc", Agc, {"linear": Linear, "plateau": Plateau, "fixed": Fixed, "none": Plain})
"""AGCs of one curve for the whole picture."""

Tiles = Annotated[int, Field(ge=1, le=64)]


class Around(Agc):
    """An AGC that has another one in it, whose memory is its own."""

    @property
    @abstractmethod
    def inner(self) -> Agc:
        """The other one."""

    def before(self, counts: Image, bits: int) -> Image:
        """What the other one gets for counts."""
        return counts

    def behind(self, picture: Picture) -> Picture:
        """What becomes of the other one's picture."""
        return picture

    @property
    def memory(self) -> int:
        return self.inner.memory

    def ends(self, bits: int) -> tuple[int, int] | None:
        return self.inner.ends(bits)

    def display(self, counts: Image, bits: int) -> Picture:
        return self.behind(self.inner.display(self.before(counts, bits), bits))

    def look(self, counts: Image, bits: int) -> Look:
        return self.inner.look(self.before(counts, bits), bits)

    def picture(self, counts: Image, bits: int, looks: Sequence[Look]) -> Picture:
        return self.behind(self.inner.picture(self.before(counts, bits), bits, looks))


class Clahe(Around):
    """Contrast-limited adaptive histogram equalisation of another AGC's picture: each place has its own curve.

    Zuiderveld, "Contrast limited adaptive histogram equalization", Graphics Gems IV, 1994, as in OpenCV.
    """

    base: Annotated[Agc, CURVES] = Linear()
    """The AGC whose picture is equalised, one of a single curve."""
    clip_limit: Annotated[float, Field(ge=0, le=256)] = 3.0
    """How steep the curve of a place may be, in greys per grey of the base's picture, before what is clipped is
    spread evenly over the curve, which adds 1 at most; 0 is off."""
    tiles: Annotated[tuple[Tiles, Tiles], Field(strict=False)] = (8, 8)
    """Places with a curve of their own, across and down; between them it is interpolated."""

    @property
    def inner(self) -> Agc:
        return self.base

    def behind(self, picture: Picture) -> Picture:
        if self.clip_limit == 0:
            return picture
        return cv2.createCLAHE(self.clip_limit, self.tiles).apply(picture).astype(np.uint8, copy=False)


class Unsharp(Around):
    """Unsharp masking before another AGC: what differs from its surroundings is enlarged in the counts themselves.

    f + amount (f - blurred f), blurred by a Gaussian (Gonzalez & Woods, Digital Image Processing, "Unsharp
    masking and highboost filtering"). In the counts, detail is enlarged that eight bits would not hold.
    """

    base: Annotated[Agc, Family("agc", Agc, {**CURVES.kinds, "clahe": Clahe})] = Linear()
    """The AGC that shows the result."""
    amount: Annotated[float, Field(ge=0, le=20)] = 1.0
    """How much of the difference is added; 0 is off."""
    sigma_px: Annotated[float, Field(ge=0.3, le=20)] = 2.0
    """Sigma of the blur, px: larger things than a few times that are not detail."""

    @property
    def inner(self) -> Agc:
        return self.base

    def before(self, counts: Image, bits: int) -> Image:
        if self.amount == 0:
            return counts
        plain = counts.astype(np.float32)
        sharp = plain + self.amount * (plain - cv2.GaussianBlur(plain, (0, 0), self.sigma_px))
        clipped: Image = np.rint(np.clip(sharp, 0, 2**bits - 1)).astype(counts.dtype)
        return clipped
