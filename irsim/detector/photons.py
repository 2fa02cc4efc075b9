"""In-band photon radiance of temperatures."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from irsim.radiometry import Band, limits, planck
from irsim.types import Floats

# CODATA 2018, exact by definition of the SI: Planck's constant times the speed of light (J m), and
# that over Boltzmann's constant (um K).
_HC = 6.62607015e-34 * 299_792_458.0
_C2_UM = _HC / 1.380649e-23 * 1e6


@lru_cache
def photon_radiance(band: Band, temperature_k: float) -> float:
    """In-band photon radiance of a black body, 1/s/m2/sr: spectral radiance over the energy hc/lambda of a photon."""
    wavelengths, weights = _nodes(band)
    return float((planck(wavelengths, temperature_k) * wavelengths * 1e-6 / _HC) @ weights)


@lru_cache
def photon_slope(band: Band, temperature_k: float) -> float:
    """dQ/dT of the in-band photon radiance, 1/s/m2/sr/K: Planck's law differentiated, then integrated."""
    wavelengths, weights = _nodes(band)
    exponent = _C2_UM / (wavelengths * temperature_k)
    per_kelvin = planck(wavelengths, temperature_k) * exponent / (temperature_k * -np.expm1(-exponent))
    return float((per_kelvin * wavelengths * 1e-6 / _HC) @ weights)


def _nodes(band: Band) -> tuple[Floats, Floats]:
    """Wavelengths, um, and weights of a Gauss-Legendre quadrature over the band."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    low, high = limits(band)
    return (high + low) / 2 + (high - low) / 2 * nodes, (high - low) / 2 * weights
