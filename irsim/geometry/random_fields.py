"""Random fields: an anisotropic spectrum and a histogram."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from statistics import NormalDist
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from irsim.config.quantities import Number
from irsim.geometry.powerlaw import power_law
from irsim.rng import Address, normals
from irsim.types import Floats

Slope = Annotated[float, Field(ge=0, le=6)]
"""Slope of a power spectrum: beta of f^-beta."""

Betas = Annotated[tuple[Slope, Slope], Field(strict=False)]
"""Slopes of the 2-D power spectrum along x and along y."""


def _rises(values: tuple[float, ...]) -> tuple[float, ...]:
    if values and (len(values) < 2 or values[0] == values[-1] or any(b < a for a, b in pairwise(values))):
        raise PydanticCustomError("histogram", "expected values that rise; allowed: two or more, least to greatest")
    return values


Histogram = Annotated[tuple[Number, ...], Field(strict=False), AfterValidator(_rises)]
"""Values of a texture at evenly spaced shares of its pixels, least to greatest; empty: Gaussian."""


def amplitudes(
    fx: Floats, fy: Floats, beta: float, betas: Betas | None, correlation_px: float, stretch: float
) -> Floats:
    """Amplitude filter at frequencies fx, fy (cycles a px); no constant part.

    With `betas` the power is 1 / (1 + |stretch c fx|^beta_x + |c fy|^beta_y), c the correlation in
    px: slopes differ along the axes, as in clouds (generalised scale invariance, Schertzer and
    Lovejoy 1985). Else it falls alike in all directions, as `power_law` has it.
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
    """(rows, columns) float32 periodic Gaussian field of mean 0 and variance 1 with the slopes asked for."""
    if betas is None:
        return power_law(shape, beta, correlation_px, stretch, seed, *address)
    frequencies = np.fft.rfftfreq(shape[1])[None, :], np.fft.fftfreq(shape[0])[:, None]
    white = np.fft.rfft2(normals(shape, seed, *address))
    field = np.fft.irfft2(white * amplitudes(*frequencies, beta, betas, correlation_px, stretch), s=shape)
    return np.asarray(field / field.std(), dtype=np.float32)


def profile(length: int, beta: float, correlation_px: float, seed: int, *address: Address) -> Floats:
    """(length,) float64: a cut through a field whose 2-D spectrum has the slope `beta`, mean 0 and variance 1."""
    amplitude = (1 / correlation_px**2 + np.fft.rfftfreq(length) ** 2) ** (-(beta - 1) / 4)
    amplitude[0] = 0.0
    line = np.fft.irfft(np.fft.rfft(normals((length,), seed, *address)) * amplitude, n=length)
    return np.asarray(line / line.std())


def shaped(field: Floats, histogram: tuple[float, ...]) -> Floats:
    """A Gaussian field (mean 0, variance 1) with another histogram, again of mean 0 and variance 1.

    histogram: values at evenly spaced shares of the pixels, from the least to the greatest, in any
    unit ((0, 1): all values alike often; (0, .1, 1): a few stand out above many); empty leaves the
    field as it is. Each value is replaced by the one of the same rank; the spectrum changes little.
    """
    if not histogram:
        return field
    marks, values = _ranks(histogram)
    return np.interp(field, marks, values).astype(np.float32)


@lru_cache
def _ranks(histogram: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Values of a unit Gaussian, and those of the same rank in the standardised histogram."""
    shares = (np.arange(4096) + 0.5) / 4096
    marks = np.array([NormalDist().inv_cdf(share) for share in shares])
    values = np.interp(shares, np.linspace(0, 1, len(histogram)), histogram)
    return marks, (values - values.mean()) / values.std()
