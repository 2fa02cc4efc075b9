"""How a lens darkens towards the corners of the picture."""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar

import numpy as np

from irsim.geometry import Geometry
from irsim.kinds import Fraction, Part, Switches
from irsim.types import Floats


class Falloff(Part):
    """Less light off the axis: the cosine law, and vignetting by the lens's rims."""

    switches: ClassVar[Switches] = {"cos4": ("cos4", False), "vignetting": ("vignetting", 0.0)}

    cos4: bool = True
    """Light falls as the fourth power of the cosine of the angle off the axis."""
    vignetting: Fraction = 0.0
    """Share of light that rims take in the corners; it grows as the square of the distance from the axis."""

    def transmittance(self, geometry: Geometry) -> Floats:
        """(rows, cols) float32, 1 at the axis: the share of light that comes through. Read only."""
        return _transmittance(geometry, self.cos4, self.vignetting)


@lru_cache(maxsize=4)
def _transmittance(geometry: Geometry, cos4: bool, vignetting: float) -> Floats:
    columns, rows = geometry.size
    right, down = np.arange(columns) - geometry.principal[0], np.arange(rows)[:, None] - geometry.principal[1]
    squared = right**2 + down**2
    share = 1 - vignetting * squared / squared.max()
    if cos4:
        share = share / (1 + squared * geometry.ifov_rad**2) ** 2  # tan = distance * ifov; cos^2 = 1 / (1 + tan^2)
    rounded: Floats = share.astype(np.float32)
    rounded.flags.writeable = False
    return rounded
