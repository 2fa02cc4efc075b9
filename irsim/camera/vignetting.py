"""Vignetting: loss of light towards the corners of the picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from irsim.config.base import Part, Switches
from irsim.config.quantities import Fraction
from irsim.geometry.projection import Geometry
from irsim.types import Floats, read_only


class Vignetting(Part):
    """Loss of light off the axis: the cosine-fourth law, and mechanical vignetting by the rims of the lens."""

    switches: ClassVar[Switches] = {"cos4": ("cos4", False), "vignetting": ("vignetting", 0.0)}

    cos4: bool = True
    """Cosine-fourth law: light falls as cos⁴ of the angle off the axis, which a zoom reduces."""
    vignetting: Fraction = 0.0
    """Share of light that the rims block in the picture's corners, at any zoom; it grows as the square of the distance
    from the axis."""

    def transmittance(self, geometry: Geometry) -> Floats:
        """Return the transmittance relative to the axis, (rows, cols) float32, read only."""
        return _transmittance(geometry.size, geometry.axis_px, geometry.ifov_rad if self.cos4 else 0.0, self.vignetting)


@dataclass(frozen=True, eq=False)
class VignettingMap:
    """Vignetting in each frame of a camera.

    geometry  of the camera before it zooms
    zooms     (n,) focal length in each frame relative to the initial one; None without zoom
    """

    vignetting: Vignetting
    geometry: Geometry
    zooms: Floats | None = None

    def __call__(self, index: int) -> Floats:
        """Return the transmittance relative to the axis in frame `index`, (rows, cols) float32, read only."""
        zoom = 1.0 if self.zooms is None else float(self.zooms[index])
        return self.vignetting.transmittance(self.geometry.zoomed(zoom))


@lru_cache(maxsize=4)
def _transmittance(size: tuple[int, int], axis_px: tuple[float, float], slope: float, vignetting: float) -> Floats:
    """Return the transmittance; `slope` is the tangent of the angle off the axis per px, 0 without the cosine law.

    Vignetting of a zoom lens depends on its design: here it is the same at any zoom.
    """
    squared, share = _rims(size, axis_px, vignetting)
    if slope:
        widened = squared * slope**2  # in place: at 640x512 a frame with zoom takes 0.5 ms instead of 16
        widened += 1
        share = np.divide(share, np.square(widened, out=widened), out=widened)  # cos² = 1 / (1 + tan²)
    return read_only(share.astype(np.float32))


@lru_cache(maxsize=4)
def _rims(size: tuple[int, int], axis_px: tuple[float, float], vignetting: float) -> tuple[Floats, Floats]:
    """Return the squared distance from the axis, px², and the transmittance of the rims, (rows, cols) each."""
    columns, rows = size
    right, down = np.arange(columns) - axis_px[0], np.arange(rows)[:, None] - axis_px[1]
    squared = right**2 + down**2
    return squared, 1 - vignetting * squared / squared.max()
