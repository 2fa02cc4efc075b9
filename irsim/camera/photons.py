"""In-band photon radiance of temperatures: Planck's law in photons."""

from __future__ import annotations

from functools import lru_cache

from irsim.physics.radiometry import PHOTON_J_M, planck, planck_slope, quadrature
from irsim.types import Band


@lru_cache
def photon_radiance(band: Band, temperature_k: float) -> float:
    """In-band photon radiance of a black body, 1/s/m2/sr: spectral radiance over the energy hc/lambda of a photon."""
    wavelengths, weights = quadrature(band)
    return float((planck(wavelengths, temperature_k) * wavelengths * 1e-6 / PHOTON_J_M) @ weights)


@lru_cache
def photon_slope(band: Band, temperature_k: float) -> float:
    """dQ/dT of the in-band photon radiance, 1/s/m2/sr/K: its spectral slope over the energy of a photon."""
    wavelengths, weights = quadrature(band)
    return float((planck_slope(wavelengths, temperature_k) * wavelengths * 1e-6 / PHOTON_J_M) @ weights)
