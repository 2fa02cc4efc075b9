"""Lens of a camera: diffraction and defocus beside the Gaussian blur of `psf_px`."""

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
"""Limits of wavelength x F-number / pitch. Below, diffraction is negligible beside a pixel; above, the PSF would be
larger than frames."""

_WAVELENGTHS = 5
"""Wavelengths that represent a band."""
_SOURCE_K = 300.0
"""Temperature of the black body that weights these wavelengths, K."""


class Lens(Part):
    """Diffraction by a round aperture, and defocus; `psf_px` then adds aberrations.

    The transfer function is the product of three: diffraction (2/pi)(acos v - v sqrt(1 - v^2)), v the frequency times
    wavelength times F-number, averaged over the band; the disc of defocus 2 J1(pi d f) / (pi d f); the Gaussian
    (Goodman, Introduction to Fourier Optics, 3rd ed., sec. 6.3 and 6.4).
    """

    switches: ClassVar[Switches] = {"defocus": ("defocus_px", 0.0)}

    f_number: Annotated[float, Field(ge=0.5, le=100)] = 4.0
    """Focal length over the diameter of the aperture."""
    pitch_um: Annotated[float, Field(gt=0, le=1000)] = 15.0
    """Side of a pixel, um."""
    wavelength_um: Annotated[float, Field(ge=2, le=20)] | None = None
    """Single wavelength, um; by default the camera's band, weighted by a black body of 300 K."""
    defocus_px: Annotated[float, Field(ge=0, le=20)] = 0.0
    """Diameter of the disc of defocus, px."""

    def fault(self, band: Band) -> str | None:
        """Return the reason why the lens's blur cannot be rendered in a spectral band; None if it can."""
        widths = [width for width, _ in self.airy_widths(band)]
        low, high = AIRY_PX
        if low <= min(widths) and max(widths) <= high:
            return None
        return (
            f"wavelength times F-number is {min(widths):.3g} to {max(widths):.3g} pixels; allowed: {low:g} to {high:g}"
        )

    def airy_widths(self, band: Band) -> tuple[tuple[float, float], ...]:
        """Return (wavelength x F-number / pitch, weight) for the wavelengths of a band; weights sum to one."""
        if self.wavelength_um is not None:
            return ((self.wavelength_um * self.f_number / self.pitch_um, 1.0),)
        nodes, weights = np.polynomial.legendre.leggauss(_WAVELENGTHS)
        low, high = limits(band)
        wavelengths = (high + low) / 2 + (high - low) / 2 * nodes
        light = weights * planck(wavelengths, _SOURCE_K)
        widths = wavelengths * self.f_number / self.pitch_um
        return tuple(zip(widths.tolist(), (light / light.sum()).tolist(), strict=True))

    def psf(self, band: Band, sigma_px: float) -> LensPSF:
        """Return the PSF in a band, convolved with a Gaussian of `sigma_px`."""
        return LensPSF(self.airy_widths(band), self.defocus_px, sigma_px)

    def sigma_px(self, band: Band) -> float:
        """Return the sigma of a Gaussian of about the same width: 0.42 wavelength x F-number for the Airy disc, d / 4
        (equal variance on each axis) for a disc of diameter d."""
        airy = sum(width * weight for width, weight in self.airy_widths(band))
        return math.hypot(0.42 * airy, self.defocus_px / 4)
