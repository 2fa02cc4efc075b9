"""Random fields: an anisotropic spectrum, a histogram, and a smooth change in time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from statistics import NormalDist
from typing import Annotated

import cv2
import numpy as np
from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from irsim.kinds import Number
from irsim.powerlaw import power_law
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

STEPS = 8
"""States that are worked out in one `period` of an evolving field; frames between two are their
linear mix, whose standard deviation is smaller by 0.16 % at most (correlation 0.9936 over a step)."""


def _amplitude(
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
    side: int, beta: float, betas: Betas | None, correlation_px: float, stretch: float, seed: int, *address: Address
) -> Floats:
    """(side, side) float32 periodic Gaussian field of mean 0 and variance 1 with the slopes asked for."""
    if betas is None:
        return power_law(side, beta, correlation_px, stretch, seed, *address)
    frequencies = np.fft.rfftfreq(side)[None, :], np.fft.fftfreq(side)[:, None]
    white = np.fft.rfft2(normals((side, side), seed, *address))
    field = np.fft.irfft2(white * _amplitude(*frequencies, beta, betas, correlation_px, stretch), s=(side, side))
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


def weights(place: float) -> list[tuple[int, float]]:
    """Numbers of the independent fields that make up an evolving one at time `place` (in periods), and their shares.

    A raised cosine over four of them, cos^2(pi/4 (place - j)) / sqrt(3/2): the squares add up to one
    at any time (cos^4 at steps of pi/4 sums to 3/2), so the variance is constant, and there is no
    kink where a field comes or goes.
    """
    first = int(np.floor(place)) - 1
    shares = ((j, np.cos(np.pi / 4 * (place - j)) ** 2 / np.sqrt(1.5)) for j in range(first, first + 4))
    return [(j, float(share)) for j, share in shares]


class Evolving:
    """Two independent periodic Gaussian fields of one spectrum, mean 0 and variance 1, that change in time.

    Only what it keeps for speed ever changes: a time asked for gives the same fields whatever was
    asked for before. `period`: a field one period later has a correlation of 2/3, four periods
    later none.
    """

    def __init__(
        self, side: int, beta: float, betas: Betas | None, correlation_px: float, stretch: float, seed: int, name: str
    ) -> None:
        self.side, self.seed, self.name = side, seed, name
        frequencies = np.fft.fftfreq(side)
        fx, fy = frequencies[None, :], frequencies[:, None]
        self._amplitude = _amplitude(fx, fy, beta, betas, correlation_px, stretch).astype(np.float32)[..., None]
        self._fields: dict[int, tuple[Floats, Floats]] = {}

    def _pair(self, number: int) -> tuple[Floats, Floats]:
        """Independent fields, (side, side) float32 each: the real and the imaginary part of one transform."""
        if number not in self._fields:
            white = normals((self.side, self.side, 2), self.seed, self.name, "evolving", number)
            real, imaginary = cv2.split(cv2.dft(white * self._amplitude, flags=cv2.DFT_INVERSE))
            self._fields[number] = np.asarray(real), np.asarray(imaginary)
        return self._fields[number]

    def at(self, place: float) -> tuple[Floats, Floats]:
        """Both fields, (side, side) float32 each, at a time in periods."""
        shares = weights(place)
        pairs = [(self._pair(j), share) for j, share in shares]
        self._fields = {j: self._fields[j] for j, _ in shares}
        first, second = (_mixed([(pair[i], share) for pair, share in pairs]) for i in range(2))
        return first, second


def _mixed(parts: Sequence[tuple[Floats, float]]) -> Floats:
    """The sum of fields, each times its share, float32, of variance 1 anew."""
    (first, share), *others = parts
    total = first * np.float32(share)
    for each, part in others:
        cv2.scaleAdd(each, part, total, dst=total)
    _, deviation = cv2.meanStdDev(total)
    total *= np.float32(1 / deviation.item())
    return total
