"""How a lens darkens towards the corners of the picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from irsim.config.base import Part, Switches
from irsim.config.quantities import Fraction
from irsim.geometry.projection import Geometry
from irsim.types import Floats


class Falloff(Part):
    """Less light off the axis: the cosine law, and vignetting by the lens's rims."""

    switches: ClassVar[Switches] = {"cos4": ("cos4", False), "vignetting": ("vignetting", 0.0)}

    cos4: bool = True
    """Light falls as the fourth power of the cosine of the angle off the axis, which a zoom makes smaller."""
    vignetting: Fraction = 0.0
    """Share of light that rims take in the picture's corners, at any zoom; it grows as the square of the distance from
    the axis."""

    def transmittance(self, geometry: Geometry) -> Floats:
        """(rows, cols) float32, 1 at the axis: the share of light that comes through. Read only."""
        return _transmittance(geometry.size, geometry.axis_px, geometry.ifov_rad if self.cos4 else 0.0, self.vignetting)


@dataclass(frozen=True, eq=False)
class VignettingMap:
    """The falloff in each frame of a camera.

    geometry  of the camera before it zooms
    zooms     (n,) how many times longer its focal length is in each frame; None where it does not zoom
    """

    falloff: Falloff
    geometry: Geometry
    zooms: Floats | None = None

    def __call__(self, index: int) -> Floats:
        """(rows, cols) float32: the share of light that comes through in frame `index`. Read only."""
        zoom = 1.0 if self.zooms is None else float(self.zooms[index])
        return self.falloff.transmittance(self.geometry.zoomed(zoom))


@lru_cache(maxsize=4)
def _transmittance(size: tuple[int, int], axis_px: tuple[float, float], slope: float, vignetting: float) -> Floats:
    """slope: of the tangent of the angle off the axis whose cosine counts, by px; 0 where none does.

    Where rims vignette a zoom lens, and how much, goes with its design: what is given holds for the picture.
    """
    squared, share = _rims(size, axis_px, vignetting)
    if slope:
        widened = squared * slope**2  # in place: at 640x512 a frame of a zoom takes 0.5 ms, not 16
        widened += 1
        share = np.divide(share, np.square(widened, out=widened), out=widened)  # cos^2 = 1 / (1 + tan^2)
    rounded: Floats = share.astype(np.float32)
    rounded.flags.writeable = False
    return rounded


@lru_cache(maxsize=4)
def _rims(size: tuple[int, int], axis_px: tuple[float, float], vignetting: float) -> tuple[Floats, Floats]:
    """(rows, cols) each: squared distances from the axis, px^2, and what rims let through."""
    columns, rows = size
    right, down = np.arange(columns) - axis_px[0], np.arange(rows)[:, None] - axis_px[1]
    squared = right**2 + down**2
    return squared, 1 - vignetting * squared / squared.max()
