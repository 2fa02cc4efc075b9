"""Noise that stays."""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar

import numpy as np

from irsim.detector.base import Moment, Ratio, Steady, read_only
from irsim.kinds import Switches
from irsim.rng import normals
from irsim.types import Floats


class FixedPattern(Steady):
    """The same in every frame: what non-uniformity correction leaves (vh, h and v in 3-D noise terms).

    The defaults are those of a fresh correction, tvh:vh:h:v = 1:0.3:0.15:0.08. The terms are those of
    D'Agostino and Webb, Proc. SPIE 1488 (1991).
    """

    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("pixel", "column", "row")}

    pixel: Ratio = 0.3
    """Sigma from pixel to pixel (vh), in units of the camera's NETD."""
    column: Ratio = 0.15
    """Sigma from column to column (h), in units of the camera's NETD."""
    row: Ratio = 0.08
    """Sigma from row to row (v), in units of the camera's NETD."""
    redrawn: bool = False
    """Whether each correction of the camera leaves another pattern; else all leave the same."""

    def pattern(self, moment: Moment) -> Floats:
        number = moment.corrections if self.redrawn else 0
        return _pattern(moment.shape, moment.seed, self.name, number, self.pixel, self.column, self.row)

    def spread(self, moment: Moment, fixed: bool) -> float:
        return (self.pixel**2 + self.column**2 + self.row**2) if fixed else 0.0


@lru_cache(maxsize=4)
def _pattern(
    shape: tuple[int, int], seed: int, name: str, number: int, pixel: float, column: float, row: float
) -> Floats:
    rows, columns = shape
    after = (number,) if number else ()
    pattern: Floats = (
        normals(shape, seed, "noise", name, "pixel", *after) * np.float32(pixel)
        + normals((1, columns), seed, "noise", name, "column", *after) * np.float32(column)
        + normals((rows, 1), seed, "noise", name, "row", *after) * np.float32(row)
    )
    return read_only(pattern)
