"""The point spread of a lens with diffraction, from its transfer function."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from irsim.physics.gaussian import REACH
from irsim.physics.psf import PSF, Term
from irsim.types import Floats

AIRY_REACH = 24.0
"""Wavelengths times F-number that a diffracted spread is drawn to: 0.8 % of an Airy pattern's light lies
farther out. It is laid over what is drawn, so that none is lost."""

FADE = 0.9
"""Share of that reach from which on the wings fade to nothing: their edge must not jump as the point moves."""

TERMS = 8
"""Products that the spread of bodies is drawn by, beside one that keeps its light: no pixel is off by more than
1e-4 of a point's light."""


@dataclass(frozen=True)
class LensPSF(PSF):
    """Diffraction of some colours (wavelength x F-number in px, weight), a disc of defocus and a Gaussian.

    Within a square of 2 reach px, as if it were repeated beyond, the spread is a sum of cosines whose
    amplitudes are the transfer function; a pixel's integral is theirs, without approximation.
    """

    colours: tuple[tuple[float, float], ...]
    defocus_px: float = 0.0
    sigma_px: float = 0.0

    @property
    def reach_px(self) -> int:
        widest = max(width for width, _ in self.colours)
        return math.ceil(AIRY_REACH * widest + self.defocus_px / 2 + REACH * self.sigma_px + 0.5)

    @property
    def fwhm_px(self) -> float:
        return _fwhm_px(self)

    def transfer(self, down: Floats, across: Floats) -> Floats:
        frequency = np.hypot(down, across)
        total = np.zeros_like(frequency)
        for width, weight in self.colours:
            total += weight * diffraction(frequency * width)
        total *= np.exp(-2 * (np.pi * self.sigma_px * frequency) ** 2)
        return total * disc(frequency * self.defocus_px) if self.defocus_px else total

    def share(self, rows: Floats, columns: Floats) -> Floats:
        form = _form(self)
        down, across = (form.cosines(np.asarray(places, dtype=np.float64)) for places in (rows, columns))
        return np.asarray(down @ form.amplitudes @ across.T)

    def wider(self, sigma_px: float) -> LensPSF:
        return replace(self, sigma_px=math.hypot(self.sigma_px, sigma_px))

    def spreading(self, fine: int) -> Sequence[Term]:
        return _spreading(self, fine)


def diffraction(frequency: Floats) -> Floats:
    """Transfer function of a round aperture at frequency x wavelength x F-number (Goodman, sec. 6.3)."""
    v = np.minimum(np.abs(frequency), 1.0)
    return np.asarray(2 / np.pi * (np.arccos(v) - v * np.sqrt(1 - v**2)))


def disc(frequency: Floats) -> Floats:
    """Transfer function of an even disc at frequency x diameter: 2 J1(pi f) / (pi f)."""
    from scipy.special import j1  # 0.3 s to import: only where something is out of focus

    x = np.maximum(np.pi * np.abs(frequency), 1e-9)
    return np.asarray(2 * j1(x) / x)


@dataclass(frozen=True, eq=False)
class _Form:
    """The spread as a sum of cosines: their period, px; frequencies (n,), cycles a px; amplitudes (n, n)."""

    period: float
    frequencies: Floats
    amplitudes: Floats

    def cosines(self, offsets: Floats, fine: float = np.inf) -> Floats:
        """(m, n) each cosine integrated over pixels (m,) px off, for light that fills a cell of 1/fine px."""
        factors, ends = self._factors() * np.sinc(self.frequencies / fine), faded(offsets, self.period / 2)[:, None]
        return np.asarray(np.cos(2 * np.pi * np.outer(offsets, self.frequencies)) * factors * ends)

    def slopes(self, offsets: Floats, fine: int) -> Floats:
        """(m, n) the same for light of density 12 t, t from -1/2 to 1/2 across the cell: a first moment of one."""
        half = np.pi * self.frequencies / fine
        with np.errstate(divide="ignore", invalid="ignore"):
            moment = np.where(half > 0, np.sin(half) / half**2 - np.cos(half) / half, 0.0)
        waves = np.sin(2 * np.pi * np.outer(offsets, self.frequencies))
        return np.asarray(waves * (6 * moment * self._factors()) * faded(offsets, self.period / 2)[:, None])

    def _factors(self) -> Floats:
        counts = np.where(self.frequencies > 0, 2.0, 1.0)
        return np.asarray(counts / self.period * np.sinc(self.frequencies))


def faded(offsets: Floats, reach_px: float) -> Floats:
    """What is left, 1 to 0, at offsets (n,) px along an axis of a spread that fades to nothing at its reach."""
    outward = np.clip((np.abs(offsets) / reach_px - FADE) / (1 - FADE), 0, 1)
    return np.asarray(np.cos(np.pi / 2 * outward) ** 2)


@lru_cache(maxsize=8)
def _form(spread: LensPSF) -> _Form:
    period = 2.0 * spread.reach_px
    highest = 1 / min(width for width, _ in spread.colours)
    frequencies = np.arange(math.floor(period * highest) + 1) / period
    amplitudes = spread.transfer(frequencies[:, None], frequencies)
    pixels = np.arange(-spread.reach_px, spread.reach_px + 1.0)
    bare = _Form(period, frequencies, amplitudes)
    sums = bare.cosines(pixels).sum(axis=0)
    return _Form(period, frequencies, amplitudes / (sums @ amplitudes @ sums))


@lru_cache(maxsize=8)
def _terms(spread: LensPSF) -> tuple[Floats, Floats]:
    """Weights (TERMS + 1,) and amplitudes of cosines (n, TERMS + 1): the largest eigenvectors of the spread, and
    the product of what the sums along either axis lack without the others, so that these sums are whole."""
    form = _form(spread)
    values, vectors = np.linalg.eigh(form.amplitudes)
    largest = np.argsort(-np.abs(values))[:TERMS]
    weights, vectors = values[largest], vectors[:, largest]
    sums = form.cosines(np.arange(-spread.reach_px, spread.reach_px + 1.0)).sum(axis=0)
    lacking = form.amplitudes @ sums - vectors @ (weights * (sums @ vectors))
    return np.append(weights, 1 / (sums @ lacking)), np.column_stack([vectors, lacking])


@lru_cache(maxsize=64)
def _spreading(spread: LensPSF, fine: int) -> tuple[Term, ...]:
    form, (weights, vectors), reach = _form(spread), _terms(spread), spread.reach_px
    offsets = np.arange(-reach, reach + 1) - ((np.arange(fine) + 0.5) / fine - 0.5)[:, None]  # of pixels from cells, px
    even, rising = (
        np.ascontiguousarray((waves @ vectors).T).reshape(-1, *offsets.shape)
        for waves in (form.cosines(offsets.ravel(), fine), form.slopes(offsets.ravel(), fine))
    )
    even.setflags(write=False)
    rising.setflags(write=False)
    return tuple(zip(weights.tolist(), even, rising, strict=True))


@lru_cache(maxsize=64)
def _fwhm_px(spread: LensPSF) -> float:
    def light(offset: float) -> float:
        return float(spread.share(np.zeros(1), np.array([offset]))[0, 0])

    low, high, half = 0.0, float(spread.reach_px), light(0.0) / 2
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if light(middle) > half else (low, middle)
    return low + high
