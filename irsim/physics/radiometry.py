"""In-band radiance of black bodies (Planck's law, integrated over a band, from a table), and the counts it gives."""

from __future__ import annotations

import math
import sys
from bisect import bisect
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from irsim.types import Band, BandName, Curve, Floats

BAND_UM: dict[BandName, tuple[float, float]] = {"mwir": (3.0, 5.0), "lwir": (8.0, 12.0)}
"""Limits of the named bands, um."""

BAND_LIMITS_UM = (2.0, 20.0)
"""Allowed limits of a band, um. At shorter wavelengths sunlight is not small beside thermal emission, and the radiance
of the table's coldest temperature underflows."""

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
"""Temperatures of the table, K; temperatures outside are clamped to its ends (at 10 K the radiance is zero in
effect)."""


def limits(band: Band) -> tuple[float, float]:
    """Return the lower and upper limit of a band, um."""
    return BAND_UM[band] if isinstance(band, str) else band


def band_fault(band: Band) -> str | None:
    """Return the reason why the limits of a band are invalid; None if they are valid."""
    low, high = limits(band)
    if not BAND_LIMITS_UM[0] <= low < high <= BAND_LIMITS_UM[1]:
        allowed = f"from {BAND_LIMITS_UM[0]:g} to {BAND_LIMITS_UM[1]:g} um"
        return f"{low:g} to {high:g} um is no band; allowed: two limits {allowed}, the lower first"
    if high - low < NARROWEST_UM:
        return f"{low:g} to {high:g} um is too narrow; allowed: a width of {NARROWEST_UM:g} um or more"
    return None


def planck(wavelength_um: float | Floats, temperature_k: float | Floats) -> Floats:
    """Return the spectral radiance of a black body, W/m2/sr/um (Planck's law)."""
    wavelength = np.asarray(wavelength_um) * 1e-6
    exponent = np.minimum(_C2 / (wavelength * temperature_k), 700.0)  # exp(709.8) overflows a float64
    return np.asarray(_C1L / wavelength**5 / np.expm1(exponent) * 1e-6)


def planck_slope(wavelength_um: float | Floats, temperature_k: float | Floats) -> Floats:
    """Return dL/dT of the spectral radiance, W/m2/sr/um/K, at 10 K and above."""
    exponent = _C2 / (np.asarray(wavelength_um) * 1e-6 * temperature_k)
    return planck(wavelength_um, temperature_k) * exponent / (temperature_k * -np.expm1(-exponent))


@lru_cache
def quadrature(band: Band) -> tuple[Floats, Floats]:
    """Return wavelengths, um, and weights of a Gauss-Legendre quadrature over the band, exact to 1e-12 above 100 K."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    low, high = limits(band)
    return (high + low) / 2 + (high - low) / 2 * nodes, (high - low) / 2 * weights


@lru_cache
def _table(band: Band) -> tuple[Floats, Floats]:
    """Return minus the inverse temperature (1/K) and the log of the in-band radiance, both increasing.

    By Wien's law one is nearly linear in the other: with 2,000 points linear interpolation is within 2e-6 of Planck's
    law (1e-5 for a band of 2 to 20 um).
    """
    temperatures = np.geomspace(*TABLE_K, 2000)
    wavelengths, weights = quadrature(band)
    return -1 / temperatures, np.log(planck(wavelengths, temperatures[:, None]) @ weights)


def radiance(band: Band, temperature_k: float | Floats) -> Floats:
    """Return the in-band radiance of a black body, W/m2/sr, at a temperature, K (any shape, > 0)."""
    inverse_t, log_l = _table(band)
    return np.exp(np.interp(-1 / np.asarray(temperature_k), inverse_t, log_l))


def grey_body(
    band: Band, temperature_k: float | Floats, emissivity: float | Floats, surroundings: float | Floats
) -> Floats:
    """Return the in-band radiance of an opaque grey body, W/m2/sr; arrays broadcast.

    It emits at its temperature, K, and reflects the radiance of its surroundings, W/m2/sr, with 1 - emissivity
    (Kirchhoff's law).
    """
    return np.asarray(emissivity * radiance(band, temperature_k) + (1 - emissivity) * surroundings)


def temperature(band: Band, radiance: float | Floats) -> Floats:
    """Return the black-body temperature, K, of an in-band radiance, W/m2/sr (any shape): the inverse of `radiance`."""
    inverse_t, log_l = _table(band)
    levels = np.asarray(radiance)
    least = np.finfo(np.float32 if levels.dtype == np.float32 else np.float64).tiny
    return np.asarray(-1 / np.interp(np.log(np.maximum(levels, least)), log_l, inverse_t))


def temperature_of(band: Band, radiance: float) -> float:
    """Return the black-body temperature, K, of one radiance, W/m2/sr, in a fifth of the time of `temperature`."""
    log_l, inverse_t = _table_lists(band)
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
def _table_lists(band: Band) -> tuple[list[float], list[float]]:
    """Return the table as lists: log in-band radiance, and minus inverse temperature."""
    inverse_t, log_l = _table(band)
    return log_l.tolist(), inverse_t.tolist()


def slope(band: Band, temperature_k: float) -> float:
    """Return dL/dT of the in-band radiance at a temperature, W/m2/sr/K."""
    wavelengths, weights = quadrature(band)
    return float(planck_slope(wavelengths, temperature_k) @ weights)


def hemisphere(sky: Callable[[Floats], Floats]) -> float:
    """Return the mean radiance, W/m2/sr, over all directions of a sky; `sky` returns radiances at elevations, rad.

    Solid angle is uniform in the sine of elevation. Gauss-Legendre quadrature is within 1e-6 for the skies of
    `Atmosphere`. A matt surface of random orientation reflects half the mean of the sky and half the mean of the
    ground, as the mean of max(n w, 0) over all normals n is the same for any direction w.
    """
    elevations, weights = _elevation_quadrature()
    return float(np.sum(weights * sky(elevations)))


@lru_cache(maxsize=1)
def _elevation_quadrature() -> tuple[Floats, Floats]:
    """Return elevations, rad, and their weights in the mean over a hemisphere."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    return np.arcsin((nodes + 1) / 2), weights / 2


@dataclass(frozen=True, slots=True)
class Scale:
    """Conversion of in-band radiance L, W/m2/sr, to a noiseless count: `linear` L + `root` sqrt(L) + `zero`.

    `root` is 0 where counts are linear in radiance. It is above 0 for a detector that counts photons, as hotter bodies
    emit fewer photons per watt (`irsim.camera.sensor.ElectronSensor`).
    """

    linear: float
    root: float
    zero: float

    @classmethod
    def between(cls, band: Band, range_k: tuple[float, float], bits: int) -> Scale:
        """Return the scale linear in radiance on which black bodies at `range_k`, K, give count 0 and full scale."""
        dark, bright = (float(radiance(band, kelvin)) for kelvin in range_k)
        linear = (2**bits - 1) / (bright - dark)
        return cls(linear, 0.0, -linear * dark)

    @classmethod
    def known(cls, curve: Curve | None, band: Band, range_k: tuple[float, float], bits: int) -> Scale:
        """Return the scale of coefficients `curve` (linear, root, zero); if this is None, the linear scale of
        `range_k`."""
        return cls.between(band, range_k, bits) if curve is None else cls(*curve)

    def light(self, counts: Floats) -> Floats:
        """Return the in-band radiance, W/m2/sr, of counts (any shape, float32 or float64).

        If `root` is not 0, linear L + root sqrt(L) = c is solved by sqrt(L) = 2 c / (root + sqrt(root^2 + 4 linear c)).
        Counts below `zero` give 0.
        """
        if not self.root:
            return counts * counts.dtype.type(1 / self.linear) - counts.dtype.type(self.zero / self.linear)
        kind = counts.dtype.type
        above = np.maximum(counts - kind(self.zero), kind(0))
        over = kind(self.root) + np.sqrt(kind(self.root**2) + kind(4 * self.linear) * above)
        light: Floats = (2 * above / over) ** 2
        return light

    def rise(self, before: Floats, after: Floats) -> Floats:
        """Return the change in counts from radiance `before`, W/m2/sr, 0 or more, to radiance `after` (any shape)."""
        kind = after.dtype.type
        rise: Floats = (after - before) * kind(self.linear)
        if self.root:
            rise += kind(self.root) * (np.sqrt(np.maximum(after, kind(0))) - np.sqrt(before))
        return rise

    def slope(self, light: float) -> float:
        """Return the slope of the scale, counts per W/m2/sr, at a radiance above 0."""
        return float(self.linear + self.root / (2 * np.sqrt(light)))
