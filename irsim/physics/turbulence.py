"""Optical turbulence: image wander (tilt), blur, and scintillation of points, all set by one strength Cn2.

All formulas are for Kolmogorov turbulence of constant strength along the path and a spherical wave (a source at a
finite range); k = 2 pi / wavelength, at the middle of the band.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.base import Part
from irsim.config.quantities import Metres, NotNegative
from irsim.physics.radiometry import limits
from irsim.rng import stream
from irsim.types import Band, Floats

TILT_KNEE = 0.6
"""Knee of the tilt spectrum, in units of wind over aperture: 0.3 (n + 1) for Zernike modes of radial order n = 1
(Conan, Rousset & Madec, J. Opt. Soc. Am. A 12, 1559, 1995)."""

_WAVES = 64
"""Number of sinusoids in a random process. The kurtosis of their sum is within 3 % of that of a Gaussian."""


class Turbulence(Part):
    """Turbulence between camera and scene; `cn2: 0` is still air."""

    cn2: Annotated[float, Field(ge=0, le=1e-10)] = 0.0
    """Structure constant of the refractive index, m^-2/3: 1e-16 weak, 1e-14 moderate, 1e-12 strong near hot ground."""
    path_m: Metres = 1000.0
    """Path length for tilt and blur of the whole image, m; scintillation uses the range of each target."""
    aperture_m: Metres = 0.05
    """Diameter of the camera's entrance pupil, m."""
    wind_m_s: NotNegative = 3.0
    """Crosswind, m/s; sets the rate of change of tilt and scintillation, which are frozen at 0."""

    def tilt_rms(self, band: Band) -> float:
        """Return the standard deviation of the angle of arrival on one axis, rad."""
        return tilt_rad(self._r0(band), self.aperture_m, wavelength_m(band)) if self.cn2 else 0.0

    def blur_rms(self, band: Band) -> float:
        """Return the sigma of the Gaussian blur of one short exposure, rad.

        Its variance is that of the long exposure minus that of tilt. It is 0 for an aperture much smaller than Fried's
        r0: images through such an aperture wander without blur.
        """
        if self.cn2 == 0:
            return 0.0
        long = long_exposure_rad(self._r0(band), wavelength_m(band))
        return math.sqrt(max(long**2 - self.tilt_rms(band) ** 2, 0.0))

    def _r0(self, band: Band) -> float:
        return fried_m(self.cn2, self.path_m, wavelength_m(band))

    def tilt_angles(self, frames: Floats, band: Band, rate_hz: float, seed: int) -> Floats:
        """Return azimuth, elevation and roll of the image, (n, 3) rad, at frame numbers (n,); roll is 0."""
        frames = np.asarray(frames, dtype=np.float64)
        if self.cn2 == 0:
            return np.zeros((len(frames), 3))
        rng = stream(seed, "turbulence", "tilt")
        knee = TILT_KNEE * self.wind_m_s / self.aperture_m
        hertz = tilt_hertz(rng.uniform(size=(2, 1, _WAVES)), knee)
        waves = _unit_process(hertz, rng.uniform(0, 2 * np.pi, (2, 1, _WAVES)), frames[:, None] / rate_hz)
        tilt = self.tilt_rms(band) * waves
        return np.stack([tilt[0], tilt[1], np.zeros_like(frames)], axis=-1)

    def scintillation(self, name: str, time: float, range_m: float, size_m: float, band: Band, seed: int) -> float:
        """Return the factor, mean 1, on the contrast of a target `size_m` wide at a range, m, at a time, s.

        It is log-normal. Its logarithm is Gaussian in time with the correlation exp(-t^2 / (2 T^2)); T is the time in
        which the wind crosses the wider of a Fresnel zone and the aperture.
        """
        if self.cn2 == 0:
            return 1.0
        wavelength = wavelength_m(band)
        index = scintillation_index(self.cn2, range_m, wavelength, self.aperture_m, size_m)
        sigma = math.sqrt(math.log1p(index))
        width = max(math.sqrt(wavelength * range_m), self.aperture_m)
        rng = stream(seed, "turbulence", "twinkle", name)
        hertz = rng.standard_normal(_WAVES) * self.wind_m_s / (2 * np.pi * width)
        unit = float(_unit_process(hertz, rng.uniform(0, 2 * np.pi, _WAVES), np.asarray(time)))
        return math.exp(sigma * unit - sigma**2 / 2)


def wavelength_m(band: Band) -> float:
    """Return the middle of a band, m."""
    low, high = limits(band)
    return (low + high) / 2 * 1e-6


def fried_m(cn2: float, path_m: float, wavelength_m: float) -> float:
    """Return Fried's r0, m: (0.423 k^2 Cn2 L 3/8)^(-3/5) (Fried, J. Opt. Soc. Am. 56, 1372, 1966; spherical wave)."""
    k = 2 * math.pi / wavelength_m
    return float((0.423 * 3 / 8 * k**2 * cn2 * path_m) ** -0.6)


def long_exposure_rad(r0_m: float, wavelength_m: float) -> float:
    """Return the sigma, rad, of the Gaussian with the half width of a long exposure, 0.98 wavelength / r0 (Fried
    1966)."""
    return 0.98 * wavelength_m / r0_m / math.sqrt(8 * math.log(2))


def tilt_rad(r0_m: float, aperture_m: float, wavelength_m: float) -> float:
    """Return the standard deviation of tilt on one axis, rad: variance 0.182 (D/r0)^(5/3) (wavelength/D)^2.

    Noll (J. Opt. Soc. Am. 66, 207, 1976) has 0.449 (D/r0)^(5/3) rad^2 for one tilt mode, whose unit is 4 / (k D) in
    angle: 0.449 (2/pi)^2 = 0.182.
    """
    return math.sqrt(0.182 * (aperture_m / r0_m) ** (5 / 3)) * wavelength_m / aperture_m


def tilt_hertz(uniform: Floats, knee_hz: float) -> Floats:
    """Return frequencies, Hz, distributed as the power of tilt, from uniform numbers in [0, 1).

    Power falls as f^(-2/3) below the knee and as f^(-17/3) above it (Conan et al. 1995). 14/15 of it lie below; both
    parts of the distribution function are inverted in closed form.
    """
    below = np.minimum(uniform * 15 / 14, 1.0) ** 3
    above = (15 * (1 - np.maximum(uniform, 14 / 15))) ** (-3 / 14)
    return np.asarray(knee_hz * np.where(uniform < 14 / 15, below, above))


def scintillation_index(
    cn2: float, range_m: float, wavelength_m: float, aperture_m: float = 0.0, size_m: float = 0.0
) -> float:
    """Return the scintillation index: variance of the irradiance over its squared mean.

    Weak: b^2 = 0.4 * 1.23 Cn2 k^(7/6) L^(11/6) (Rytov, spherical wave). Strong turbulence saturates it:
    exp(0.49 b^2 / (1 + 0.56 b^(12/5))^(7/6) + 0.51 b^2 / (1 + 0.69 b^(12/5))^(5/6)) - 1 (Andrews & Phillips,
    Laser Beam Propagation through Random Media, 2nd ed., 2005, ch. 9). It is averaged over the aperture and, by
    reciprocity, in the same way over the target.
    """
    k = 2 * math.pi / wavelength_m
    weak = 0.4 * 1.23 * cn2 * k ** (7 / 6) * range_m ** (11 / 6)
    power = weak ** (6 / 5)
    index = math.expm1(0.49 * weak / (1 + 0.56 * power) ** (7 / 6) + 0.51 * weak / (1 + 0.69 * power) ** (5 / 6))
    for width in (aperture_m, size_m):
        index *= aperture_averaging(k * width**2 / (4 * range_m))
    return index


_LOG_RATIO = np.arange(-3.0, 4.1, 0.5) * math.log(10)
_LOG_LOST = np.array(
    [-5.313, -4.421, -3.546, -2.685, -1.835, -0.980, -0.096, 0.851, 1.882, 2.995, 4.175, 5.405, 6.673, 7.965, 9.274]
)
"""log(1/A - 1) at k D^2 / 4L of 0.001 to 10,000, by Rytov's integral for a spherical wave: sin^2(kappa^2 z (L - z) /
(2 k L)) (2 J1(x) / x)^2 kappa^(-8/3) over kappa and z, x = kappa D z / 2L. The usual 1 / (1 + 0.214 (k D^2 /
4L)^(7/6)) (Churnside, Appl. Opt. 30, 1982, 1991) is its limit for wide apertures only."""


def aperture_averaging(ratio: float) -> float:
    """Return the aperture-averaging factor A of weak scintillation, 1 for a point, from k D^2 / 4L."""
    if ratio == 0:
        return 1.0
    place = math.log(ratio)
    # Beyond the table, A follows the power laws of its ends.
    beyond = 7 / 6 * max(place - _LOG_RATIO[-1], 0) + 5 / 6 * min(place - _LOG_RATIO[0], 0)
    return 1 / (1 + math.exp(float(np.interp(place, _LOG_RATIO, _LOG_LOST)) + beyond))


def _unit_process(hertz: Floats, phases: Floats, seconds: Floats) -> Floats:
    """Return a random process of unit variance at times (..., 1) or (): a sum of sinusoids along the last axis."""
    scale = math.sqrt(2 / hertz.shape[-1])
    return np.asarray(scale * np.cos(2 * np.pi * hertz * seconds + phases).sum(axis=-1))
