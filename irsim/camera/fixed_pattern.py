"""Noise that stays."""

from __future__ import annotations

from typing import ClassVar

from irsim.camera.noise_base import FrameContext, Ratio, Steady
from irsim.camera.terms import Term, staying
from irsim.config.base import Switches
from irsim.types import Floats


class FixedPattern(Steady):
    """The same in every frame: what non-uniformity correction leaves (vh, h and v in 3-D noise terms).

    The defaults are those of a fresh correction, tvh:vh:h:v = 1:0.3:0.15:0.08. The terms are those of
    D'Agostino and Webb, Proc. SPIE 1488 (1991).
    """

    stationary: ClassVar[bool] = True
    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("pixel", "column", "row")}

    pixel: Ratio = 0.3
    """Sigma from pixel to pixel (vh), in units of the camera's NETD."""
    column: Ratio = 0.15
    """Sigma from column to column (h), in units of the camera's NETD."""
    row: Ratio = 0.08
    """Sigma from row to row (v), in units of the camera's NETD."""
    redrawn: bool = False
    """Whether each correction of the camera leaves another pattern; else all leave the same."""

    def pattern(self, frame_context: FrameContext) -> Floats:
        number = frame_context.corrections if self.redrawn else 0
        terms: tuple[Term, ...] = (
            ("pixel", "pixel", self.pixel),
            ("column", "column", self.column),
            ("row", "row", self.row),
        )
        return staying(frame_context.shape, frame_context.seed, self.name, terms, number)

    def spread(self, frame_context: FrameContext, fixed: bool) -> float:
        return (self.pixel**2 + self.column**2 + self.row**2) if fixed else 0.0
