"""In-band radiance of temperatures: Planck's law integrated over a band, through a table."""

from __future__ import annotations

import math
import sys
from bisect import bisect
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from irsim.types import Band, BandName, Floats

BAND_UM: dict[BandName, tuple[float, float]] = {"mwir": (3.0, 5.0), "lwir": (8.0, 12.0)}
"""Limits of each named band, um."""

REACH_UM = (2.0, 20.0)
"""Where the limits of a band may lie, um: at shorter wavelengths the sun's light is no longer small beside
a body's own, and the table's coldest temperature gives no light that a float can hold."""

NARROWEST_UM = 0.05
"""Least width of a band, um."""

# CODATA 2018, exact by definition of the SI: Planck's constant h (J s), the speed of light c (m/s) and
# Boltzmann's constant k (J/K); of them the first radiation constant for radiance 2hc^2 (W m^2 / sr) and the
# second radiation constant hc/k (m K).
_H, _C, _K = 6.62607015e-34, 299_792_458.0, 1.380649e-23
_C1L = 2 * _H * _C**2
_C2 = _H * _C / _K

PHOTON_J_M = _H * _C
"""Energy of a photon times its wavelength, hc, J m."""

TABLE_K = (10.0, 6000.0)
"""Temperatures that the table covers, K; others are taken for the nearer end (at 10 K nothing shines)."""


def limits(band: Band) -> tuple[float, float]:
    """Lower and upper limit of a band, um."""
    return BAND_UM[band] if isinstance(band, str) else band


def band_fault(band: Band) -> str | None:
    """What is wrong with a band's limits; None where nothing is."""
    low, high = limits(band)
    if not REACH_UM[0] <= low < high <= REACH_UM[1]:
        reach = f"from {REACH_UM[0]:g} to {REACH_UM[1]:g} um"
        return f"{low:g} to {high:g} um is no band; allowed: two limits {reach}, the lower first"
    if high - low < NARROWEST_UM:
        return f"{low:g} to {high:g} um is too narrow; allowed: a width of {NARROWEST_UM:g} um or more"
    return None


def planck(wavelength_um: float | Floats, temperature_k: float | Floats) -> Floats:
    """Spectral radiance of a black body, W/m2/sr/um (Planck's law)."""
    wavelength = np.asarray(wavelength_um) * 1e-6
    exponent = np.minimum(_C2 / (wavelength * temperature_k), 700.0)  # exp(700) is near the float's end
    return np.asarray(_C1L / wavelength**5 / np.expm1(exponent) * 1e-6)


def planck_slope(wavelength_um: float | Floats, temperature_k: float | Floats) -> Floats:
    """dL/dT of the spectral radiance, W/m2/sr/um/K: Planck's law differentiated, at 10 K and more."""
    exponent = _C2 / (np.asarray(wavelength_um) * 1e-6 * temperature_k)
    return planck(wavelength_um, temperature_k) * exponent / (temperature_k * -np.expm1(-exponent))


@lru_cache
def quadrature(band: Band) -> tuple[Floats, Floats]:
    """Wavelengths, um, and weights of a Gauss-Legendre quadrature over the band, exact to 1e-12 from 100 K up."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    low, high = limits(band)
    return (high + low) / 2 + (high - low) / 2 * nodes, (high - low) / 2 * weights


@lru_cache
def _table(band: Band) -> tuple[Floats, Floats]:
    """Minus inverse temperature (1/K) and log in-band radiance, both rising.

    By Wien's law the one is nearly linear in the other: 2,000 points keep linear interpolation
    within 2e-6 of Planck (a band of 2 to 20 um: within 1e-5).
    """
    temperatures = np.geomspace(*TABLE_K, 2000)
    wavelengths, weights = quadrature(band)
    return -1 / temperatures, np.log(planck(wavelengths, temperatures[:, None]) @ weights)


def radiance(band: Band, temperature_k: float | Floats) -> Floats:
    """In-band radiance of a black body, W/m2/sr, of its temperature, K (any shape, > 0)."""
    inverse_t, log_l = _table(band)
    return np.exp(np.interp(-1 / np.asarray(temperature_k), inverse_t, log_l))


def grey_body(
    band: Band, temperature_k: float | Floats, emissivity: float | Floats, surroundings: float | Floats
) -> Floats:
    """In-band radiance of an opaque grey body, W/m2/sr: what it emits at a temperature, K, and what it reflects of
    surroundings of one radiance, W/m2/sr, 1 less its emissivity (Kirchhoff's law). Arrays broadcast."""
    return np.asarray(emissivity * radiance(band, temperature_k) + (1 - emissivity) * surroundings)


def temperature(band: Band, radiance: float | Floats) -> Floats:
    """Black-body temperature, K, of an in-band radiance, W/m2/sr (any shape): the inverse of `radiance`."""
    inverse_t, log_l = _table(band)
    levels = np.asarray(radiance)
    least = np.finfo(np.float32 if levels.dtype == np.float32 else np.float64).tiny
    return np.asarray(-1 / np.interp(np.log(np.maximum(levels, least)), log_l, inverse_t))


def temperature_of(band: Band, radiance: float) -> float:
    """`temperature` of a single one, in a fifth of the time."""
    log_l, inverse_t = _steps(band)
    level = math.log(max(radiance, sys.float_info.min))
    after = bisect(log_l, level, 1, len(log_l) - 1)
    low, high = log_l[after - 1], log_l[after]
    if level < low:
        level = low
    elif level > high:
        level = high
    before = inverse_t[after - 1]
    return -1 / (before + (level - low) / (high - low) * (inverse_t[after] - before))


@lru_cache
def _steps(band: Band) -> tuple[list[float], list[float]]:
    """Log in-band radiance, and minus inverse temperature, as single numbers."""
    inverse_t, log_l = _table(band)
    return log_l.tolist(), inverse_t.tolist()


def slope(band: Band, temperature_k: float) -> float:
    """dL/dT of the in-band radiance at a temperature, W/m2/sr/K: Planck's law differentiated, then integrated."""
    wavelengths, weights = quadrature(band)
    return float(planck_slope(wavelengths, temperature_k) @ weights)


def hemisphere(sky: Callable[[Floats], Floats]) -> float:
    """Mean radiance, W/m2/sr, over all directions of a sky, whose radiance at elevations (rad) is given: solid angle is
    even in the sine of elevation. By Gauss-Legendre, within 1e-6 of the skies here.

    A matt surface of normal n receives, over pi, the mean of L max(n w, 0) / pi over directions w, and max(n w, 0) is a
    quarter in the mean over all n, whatever w: a body whose surfaces face all ways reflects half the mean of the sky
    and half that of what is below.
    """
    elevations, weights = _evenly()
    return float(np.sum(weights * sky(elevations)))


@lru_cache(maxsize=1)
def _evenly() -> tuple[Floats, Floats]:
    """Elevations, rad, and their weights in the mean over a hemisphere."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    return np.arcsin((nodes + 1) / 2), weights / 2
