"""The lens of a camera: what blurs beside the Gaussian of `psf_px`."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.base import Part, Switches
from irsim.physics.diffraction import LensPSF
from irsim.physics.radiometry import limits, planck
from irsim.types import Band

AIRY_PX = (0.1, 10.0)
"""Where wavelength x F-number / pitch may lie: below, diffraction is nothing beside a pixel; above, the spread
would outgrow pictures."""

_SHADES = 5
"""Wavelengths that a band is taken for."""
_SOURCE_K = 300.0
"""The black body whose light weighs them."""


class Lens(Part):
    """Diffraction by a round aperture, and defocus; `psf_px` is then what aberrations add to them.

    The transfer function is the product of all: of diffraction (2/pi)(acos v - v sqrt(1 - v^2)), v the
    frequency times wavelength times F-number, averaged over the band; of the disc of defocus
    2 J1(pi d f) / (pi d f); of the Gaussian (Goodman, Introduction to Fourier Optics, 3rd ed., sec. 6.3 and 6.4).
    """

    switches: ClassVar[Switches] = {"defocus": ("defocus_px", 0.0)}

    f_number: Annotated[float, Field(ge=0.5, le=100)] = 4.0
    """Focal length over the diameter of the aperture."""
    pitch_um: Annotated[float, Field(gt=0, le=1000)] = 15.0
    """Side of a pixel, um."""
    wavelength_um: Annotated[float, Field(ge=2, le=20)] | None = None
    """The one wavelength that is looked at, um; the camera's band, as a black body of 300 K shines in it, where not
    given."""
    defocus_px: Annotated[float, Field(ge=0, le=20)] = 0.0
    """Diameter of the disc that a point out of focus becomes, px."""

    def fault(self, band: Band) -> str | None:
        """Why such a lens cannot be drawn in a band; None where it can."""
        widths = [width for width, _ in self.colours(band)]
        low, high = AIRY_PX
        if low <= min(widths) and max(widths) <= high:
            return None
        return (
            f"wavelength times F-number is {min(widths):.3g} to {max(widths):.3g} pixels; allowed: {low:g} to {high:g}"
        )

    def colours(self, band: Band) -> tuple[tuple[float, float], ...]:
        """(wavelength x F-number / pitch, weight) of the light that is looked at; weights sum to one."""
        if self.wavelength_um is not None:
            return ((self.wavelength_um * self.f_number / self.pitch_um, 1.0),)
        nodes, weights = np.polynomial.legendre.leggauss(_SHADES)
        low, high = limits(band)
        wavelengths = (high + low) / 2 + (high - low) / 2 * nodes
        light = weights * planck(wavelengths, _SOURCE_K)
        widths = wavelengths * self.f_number / self.pitch_um
        return tuple(zip(widths.tolist(), (light / light.sum()).tolist(), strict=True))

    def spread(self, band: Band, sigma_px: float) -> LensPSF:
        """The point spread in a band, with a Gaussian of that sigma beside it."""
        return LensPSF(self.colours(band), self.defocus_px, sigma_px)

    def sigma_px(self, band: Band) -> float:
        """Sigma of the Gaussian that is about as wide as the lens's own spread: 0.42 wavelength x F-number for the
        Airy disc, d / 4 (the same variance on each axis) for a disc of diameter d."""
        airy = sum(width * weight for width, weight in self.colours(band))
        return math.hypot(0.42 * airy, self.defocus_px / 4)
