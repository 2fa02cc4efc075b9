"""In-band radiance of temperatures: Planck's law integrated over a band, through a table."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from irsim.types import Floats

Band = Literal["mwir", "lwir"]

BAND_UM: dict[Band, tuple[float, float]] = {"mwir": (3.0, 5.0), "lwir": (8.0, 12.0)}
"""Limits of each band, um."""

# CODATA 2018, exact by definition of the SI: first radiation constant for radiance 2hc^2
# (W m^2 / sr) and second radiation constant hc/k (m K).
_C1L = 2 * 6.62607015e-34 * 299_792_458.0**2
_C2 = 6.62607015e-34 * 299_792_458.0 / 1.380649e-23

TABLE_K = (1.0, 6000.0)
"""Temperatures that the table covers, K."""


def planck(wavelength_um: Floats, temperature_k: float | Floats) -> Floats:
    """Spectral radiance of a black body, W/m2/sr/um (Planck's law)."""
    wavelength = np.asarray(wavelength_um) * 1e-6
    exponent = np.minimum(_C2 / (wavelength * temperature_k), 700.0)  # exp(700) is near the float's end
    return np.asarray(_C1L / wavelength**5 / np.expm1(exponent) * 1e-6)


@lru_cache
def _table(band: Band) -> tuple[Floats, Floats]:
    """Log temperature and log in-band radiance; 4,000 points keep interpolation within 1e-5 of Planck."""
    temperatures = np.geomspace(*TABLE_K, 4000)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    low, high = BAND_UM[band]
    wavelengths = (high + low) / 2 + (high - low) / 2 * nodes
    radiance = planck(wavelengths, temperatures[:, None]) @ weights * (high - low) / 2
    return np.log(temperatures), np.log(radiance)


def radiance(band: Band, temperature_k: float | Floats) -> Floats:
    """In-band radiance of a black body, W/m2/sr, of its temperature (any shape)."""
    log_t, log_l = _table(band)
    return np.exp(np.interp(np.log(temperature_k), log_t, log_l))


def temperature(band: Band, radiance: float | Floats) -> Floats:
    """Black-body temperature, K, of an in-band radiance, W/m2/sr: the inverse of `radiance`."""
    log_t, log_l = _table(band)
    return np.exp(np.interp(np.log(np.maximum(radiance, 1e-300)), log_l, log_t))


def slope(band: Band, temperature_k: float) -> float:
    """dL/dT at a temperature, W/m2/sr/K."""
    step = 0.5
    above, below = radiance(band, temperature_k + step), radiance(band, temperature_k - step)
    return float((above - below) / (2 * step))
