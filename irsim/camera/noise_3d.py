"""The seven terms of 3-D noise."""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar

import numpy as np

from irsim.camera.noise_base import AT_ONCE, FrameContext, Noise, Ratio, read_only
from irsim.camera.response import Lines
from irsim.camera.terms import Term, staying
from irsim.camera.variance import Variance
from irsim.config.base import Switches
from irsim.rng import normals
from irsim.types import Floats


class Noise3d(Noise):
    """The seven terms of 3-D noise, each Gaussian and independent of the others; t ones are white in time.

    J. A. D'Agostino and C. M. Webb, "Three-dimensional analysis framework and measurement methodology
    for imaging system noise", Proc. SPIE 1488 (1991): t time, v vertical (from row to row), h
    horizontal (from column to column). All are in units of the camera's NETD.
    """

    stationary: ClassVar[bool] = True
    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("t", "v", "h", "tv", "th", "vh", "tvh")}

    t: Ratio = 0.0
    """Sigma of the level of the whole frame, anew in each frame."""
    v: Ratio = 0.0
    """Sigma from row to row, the same in all frames."""
    h: Ratio = 0.0
    """Sigma from column to column, the same in all frames."""
    tv: Ratio = 0.0
    """Sigma from row to row, anew in each frame (streaks)."""
    th: Ratio = 0.0
    """Sigma from column to column, anew in each frame (rain)."""
    vh: Ratio = 0.0
    """Sigma from pixel to pixel, the same in all frames."""
    tvh: Ratio = 1.0
    """Sigma from pixel to pixel, anew in each frame."""

    def grain(self, frame_context: FrameContext) -> float:
        return self.tvh

    def lines(self, frame_context: FrameContext) -> Lines | None:
        if not (self.t or self.tv or self.th):
            return None
        block, at = divmod(frame_context.index, AT_ONCE)
        down, across = _lines(frame_context.shape, frame_context.seed, self.name, (self.t, self.tv, self.th), block)
        return down[at], across[at]

    def steady(self, frame_context: FrameContext) -> Floats | None:
        if not (self.v or self.h or self.vh):
            return None
        terms: tuple[Term, ...] = (("v", "row", self.v), ("h", "column", self.h), ("vh", "pixel", self.vh))
        return staying(frame_context.shape, frame_context.seed, self.name, terms)

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        changing = self.tv**2 + self.th**2 + self.tvh**2
        return Variance(own=changing + (self.v**2 + self.h**2 + self.vh**2 if fixed else 0.0), shared=self.t**2)


@lru_cache(maxsize=4)
def _lines(shape: tuple[int, int], seed: int, name: str, sigmas: tuple[float, float, float], block: int) -> Lines:
    """The terms t and tv together, (AT_ONCE, rows), and the term th, (AT_ONCE, cols), of a block of frames."""

    def drawn(term: str, sigma: float, length: int) -> Floats:
        if not sigma:
            return np.zeros((AT_ONCE, length), np.float32)
        return normals((AT_ONCE, length), seed, "noise", name, term, block) * np.float32(sigma)

    (rows, columns), (t, tv, th) = shape, sigmas
    return read_only(drawn("t", t, 1) + drawn("tv", tv, rows)), read_only(drawn("th", th, columns))
