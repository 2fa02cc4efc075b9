"""Gaussian random fields with a power-law spectrum, isotropic or not, and with a given histogram."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from statistics import NormalDist
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from irsim.config.quantities import Number
from irsim.rng import Address, normals
from irsim.types import Floats

Slope = Annotated[float, Field(ge=0, le=6)]
"""Slope beta of a power spectrum f^-beta."""

Betas = Annotated[tuple[Slope, Slope], Field(strict=False)]
"""Slopes of the 2-D power spectrum along x and along y."""


def _rises(values: tuple[float, ...]) -> tuple[float, ...]:
    if values and (len(values) < 2 or values[0] == values[-1] or any(b < a for a, b in pairwise(values))):
        raise PydanticCustomError("histogram", "the values do not rise; allowed: two or more, least to greatest")
    return values


Histogram = Annotated[tuple[Number, ...], Field(strict=False), AfterValidator(_rises)]
"""Quantiles of a texture at evenly spaced probabilities, least to greatest; empty: Gaussian."""


def power_law(
    shape: tuple[int, int], beta: float, correlation_px: float, stretch: float, seed: int, *address: Address
) -> Floats:
    """Return a (rows, columns) float32 periodic Gaussian field of mean 0 and variance 1.

    Its 2-D power spectrum falls as f^-beta above 1/correlation_px cycles a px and is flat below: white noise is
    filtered by the amplitude (1/correlation_px^2 + f^2)^(-beta/4). A `stretch` above 1 elongates it along x.
    """
    return spectral(shape, beta, None, correlation_px, stretch, seed, *address)


def amplitudes(
    fx: Floats, fy: Floats, beta: float, betas: Betas | None, correlation_px: float, stretch: float
) -> Floats:
    """Return the amplitude filter at frequencies fx, fy (cycles a px), 0 at zero frequency.

    With `betas` the power is 1 / (1 + |stretch c fx|^beta_x + |c fy|^beta_y), c the correlation length in px: the
    slopes differ along the axes, as in clouds (generalised scale invariance, Schertzer and Lovejoy 1985). Otherwise
    it is isotropic, as in `power_law`.
    """
    if betas is None:
        amplitude = (1 / correlation_px**2 + (fx * stretch) ** 2 + fy**2) ** (-beta / 4)
    else:
        along = np.abs(fx * stretch * correlation_px) ** betas[0] + np.abs(fy * correlation_px) ** betas[1]
        amplitude = (1 + along) ** -0.5
    amplitude[0, 0] = 0.0
    return np.asarray(amplitude)


def spectral(
    shape: tuple[int, int],
    beta: float,
    betas: Betas | None,
    correlation_px: float,
    stretch: float,
    seed: int,
    *address: Address,
) -> Floats:
    """Return a (rows, columns) float32 periodic Gaussian field of mean 0 and variance 1; see `amplitudes`."""
    frequencies = np.fft.rfftfreq(shape[1])[None, :], np.fft.fftfreq(shape[0])[:, None]
    white = np.fft.rfft2(normals(shape, seed, *address))
    field = np.fft.irfft2(white * amplitudes(*frequencies, beta, betas, correlation_px, stretch), s=shape)
    return np.asarray(field / field.std(), dtype=np.float32)


def profile(length: int, beta: float, correlation_px: float, seed: int, *address: Address) -> Floats:
    """Return a (length,) float64 line through a field whose 2-D spectrum has slope `beta`; mean 0, variance 1."""
    amplitude = (1 / correlation_px**2 + np.fft.rfftfreq(length) ** 2) ** (-(beta - 1) / 4)
    amplitude[0] = 0.0
    line = np.fft.irfft(np.fft.rfft(normals((length,), seed, *address)) * amplitude, n=length)
    return np.asarray(line / line.std())


def with_histogram(field: Floats, histogram: tuple[float, ...]) -> Floats:
    """Return a Gaussian field (mean 0, variance 1) mapped to another histogram, again of mean 0 and variance 1.

    histogram  quantiles at evenly spaced probabilities, in any unit: (0, 1) is uniform, (0, .1, 1) few large values,
               empty returns the field unchanged

    Each value is replaced by the value of equal rank in the histogram, which changes the spectrum little.
    """
    if not histogram:
        return field
    gaussian, values = _quantiles(histogram)
    return np.interp(field, gaussian, values).astype(np.float32)


@lru_cache
def _quantiles(histogram: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return quantiles of the standard normal distribution and of the standardised histogram at equal probabilities."""
    shares = (np.arange(4096) + 0.5) / 4096
    gaussian = np.array([NormalDist().inv_cdf(share) for share in shares])
    values = np.interp(shares, np.linspace(0, 1, len(histogram)), histogram)
    return gaussian, (values - values.mean()) / values.std()
