"""The seven terms of 3-D noise."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from irsim.detector.base import Additive, Moment, Ratio, read_only
from irsim.rng import normals
from irsim.types import Floats


class Noise3d(Additive):
    """The seven terms of 3-D noise, each Gaussian and independent of the others; t ones are white in time.

    J. A. D'Agostino and C. M. Webb, "Three-dimensional analysis framework and measurement methodology
    for imaging system noise", Proc. SPIE 1488 (1991): t time, v vertical (from row to row), h
    horizontal (from column to column). All are in units of the camera's NETD.
    """

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

    def pattern(self, moment: Moment) -> Floats:
        stays = _fixed(moment.shape, moment.seed, self.name, self.v, self.h, self.vh)
        rows, columns = moment.shape
        lines = self._drawn("t", (1, 1), moment) + self._drawn("th", (1, columns), moment)
        lines = lines + self._drawn("tv", (rows, 1), moment)
        if not self.tvh:
            return stays + lines
        pattern = normals(moment.shape, moment.seed, "noise", self.name, "tvh", moment.index)
        np.multiply(pattern, np.float32(self.tvh), out=pattern)
        for added in (stays, lines):
            if added.any():
                np.add(pattern, added, out=pattern)
        return pattern

    def _drawn(self, term: str, shape: tuple[int, int], moment: Moment) -> Floats:
        sigma = getattr(self, term)
        if not sigma:
            return np.zeros((1, 1), np.float32)
        return normals(shape, moment.seed, "noise", self.name, term, moment.index) * np.float32(sigma)

    def spread(self, moment: Moment, fixed: bool) -> float:
        changing = self.t**2 + self.tv**2 + self.th**2 + self.tvh**2
        return changing + (self.v**2 + self.h**2 + self.vh**2 if fixed else 0.0)


@lru_cache(maxsize=4)
def _fixed(shape: tuple[int, int], seed: int, name: str, v: float, h: float, vh: float) -> Floats:
    """The terms that stay, (rows, cols); (1, 1) where there are none."""
    if not (v or h or vh):
        return read_only(np.zeros((1, 1), np.float32))
    rows, columns = shape
    shapes = {"v": ((rows, 1), v), "h": ((1, columns), h), "vh": (shape, vh)}
    pattern = np.zeros(shape, np.float32)
    for term, (size, sigma) in shapes.items():
        pattern += normals(size, seed, "noise", name, term) * np.float32(sigma)
    return read_only(pattern)
