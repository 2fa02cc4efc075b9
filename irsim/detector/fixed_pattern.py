"""Noise that stays."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from irsim.detector.base import Noise, Ratio
from irsim.rng import normals
from irsim.types import Floats


class FixedPattern(Noise):
    """The same in every frame: what non-uniformity correction leaves (vh, h and v in 3-D noise terms).

    The defaults are those of a fresh correction, tvh:vh:h:v = 1:0.3:0.15:0.08. The terms are those of
    D'Agostino and Webb, Proc. SPIE 1488 (1991).
    """

    pixel: Ratio = 0.3
    """Sigma from pixel to pixel (vh), in units of the camera's NETD."""
    column: Ratio = 0.15
    """Sigma from column to column (h), in units of the camera's NETD."""
    row: Ratio = 0.08
    """Sigma from row to row (v), in units of the camera's NETD."""

    def pattern(self, index: int, shape: tuple[int, int], rate_hz: float, seed: int) -> Floats:
        return _pattern(shape, seed, self.name, self.pixel, self.column, self.row)


@lru_cache(maxsize=4)
def _pattern(shape: tuple[int, int], seed: int, name: str, pixel: float, column: float, row: float) -> Floats:
    rows, columns = shape
    pattern: Floats = (
        normals(shape, seed, "noise", name, "pixel") * np.float32(pixel)
        + normals((1, columns), seed, "noise", name, "column") * np.float32(column)
        + normals((rows, 1), seed, "noise", name, "row") * np.float32(row)
    )
    pattern.flags.writeable = False
    return pattern
