"""Diffraction PSF of a lens, from its transfer function, and the far wings of its Airy pattern."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from irsim.physics.psf import PSF, SUPPORT_SIGMAS, KernelTerm, full_width
from irsim.types import Floats, read_only

AIRY_SUPPORT = 24.0
"""Half width of the drawn area in Airy widths (wavelength x F-number). 0.8 % of an Airy pattern's light lies farther
out; it is aliased into the drawn area, so the sum of the PSF is 1."""

FADE = 0.9
"""Share of the support from which the PSF fades to zero: its edge must not jump as the point moves."""

TERMS = 8
"""Number of separable terms that stand for the PSF of extended bodies; one more term conserves light. The error of a
pixel is at most 1e-4 of a point's light."""

WING_SUPPORTS = 4
"""Half width of the wings, in supports of the cosine series. At their end they are 1/64 of their value at one
support."""

LATTICE_SUM = 9.03362
"""Sum of (m^2 + n^2)^(-3/2) over all integers m and n except (0, 0): 4 zeta(3/2) beta(3/2)."""

NEAR_PERIODS = [(m, n) for m in range(-2, 3) for n in range(-2, 3) if (m, n) != (0, 0)]
"""Periodic images of the point, (down, across) in periods, whose wings are subtracted one by one."""

_FAR_PERIODS = LATTICE_SUM - sum((m * m + n * n) ** -1.5 for m, n in NEAR_PERIODS)


@dataclass(frozen=True)
class LensPSF(PSF):
    """PSF of diffraction at several wavelengths, a disc of defocus and a Gaussian.

    `airy_widths` holds (wavelength x F-number in px, weight) of each wavelength.

    On a square of side 2 support px, taken as periodic, the PSF is a cosine series whose amplitudes are the transfer
    function. The integral of each cosine over a pixel is exact.
    """

    airy_widths: tuple[tuple[float, float], ...]
    defocus_px: float = 0.0
    sigma_px: float = 0.0

    @property
    def support_px(self) -> int:
        widest = max(width for width, _ in self.airy_widths)
        return math.ceil(AIRY_SUPPORT * widest + self.defocus_px / 2 + SUPPORT_SIGMAS * self.sigma_px + 0.5)

    @property
    def fwhm_px(self) -> float:
        return _fwhm_px(self)

    def otf(self, down: Floats, across: Floats) -> Floats:
        frequency = np.hypot(down, across)
        total = np.zeros_like(frequency)
        for width, weight in self.airy_widths:
            total += weight * diffraction_otf(frequency * width)
        total *= np.exp(-2 * (np.pi * self.sigma_px * frequency) ** 2)
        return total * defocus_otf(frequency * self.defocus_px) if self.defocus_px else total

    def pixel_integral(self, rows: Floats, columns: Floats) -> Floats:
        series = _series(self)
        down, across = (series.cosines(np.asarray(places, dtype=np.float64)) for places in (rows, columns))
        return np.asarray(down @ series.amplitudes @ across.T)

    def broadened(self, sigma_px: float) -> LensPSF:
        return replace(self, sigma_px=math.hypot(self.sigma_px, sigma_px))

    def separable_kernels(self, fine: int) -> Sequence[KernelTerm]:
        return _separable_kernels(self, fine)


def diffraction_otf(frequency: Floats) -> Floats:
    """Return the OTF of a circular aperture at frequency x wavelength x F-number (Goodman, sec. 6.3)."""
    v = np.minimum(np.abs(frequency), 1.0)
    return np.asarray(2 / np.pi * (np.arccos(v) - v * np.sqrt(1 - v**2)))


def defocus_otf(frequency: Floats) -> Floats:
    """Return the OTF of a uniform disc at frequency x diameter: 2 J1(pi f) / (pi f)."""
    from scipy.special import j1  # 0.3 s to import: only needed with defocus

    x = np.maximum(np.pi * np.abs(frequency), 1e-9)
    return np.asarray(2 * j1(x) / x)


@dataclass(frozen=True, eq=False)
class _CosineSeries:
    """Cosine series of a PSF: period, px; frequencies (n,), cycles/px; amplitudes (n, n)."""

    period: float
    frequencies: Floats
    amplitudes: Floats

    def cosines(self, offsets: Floats, fine: float = np.inf) -> Floats:
        """Return the integrals (m, n) of the n cosines over pixels at offsets (m,) px, for light spread over a cell of
        1/fine px."""
        factors, ends = self._factors() * np.sinc(self.frequencies / fine), fade(offsets, self.period / 2)[:, None]
        return np.asarray(np.cos(2 * np.pi * np.outer(offsets, self.frequencies)) * factors * ends)

    def slopes(self, offsets: Floats, fine: int) -> Floats:
        """Return the same integrals as `cosines`, for light of density 12 t, t from -1/2 to 1/2 across a cell."""
        half = np.pi * self.frequencies / fine
        with np.errstate(divide="ignore", invalid="ignore"):
            moment = np.where(half > 0, np.sin(half) / half**2 - np.cos(half) / half, 0.0)
        waves = np.sin(2 * np.pi * np.outer(offsets, self.frequencies))
        return np.asarray(waves * (6 * moment * self._factors()) * fade(offsets, self.period / 2)[:, None])

    def _factors(self) -> Floats:
        counts = np.where(self.frequencies > 0, 2.0, 1.0)
        return np.asarray(counts / self.period * np.sinc(self.frequencies))


def fade(offsets: Floats, support_px: float) -> Floats:
    """Return the taper, 1 to 0, at offsets (n,) px along one axis, that ends at the support."""
    outward = np.clip((np.abs(offsets) / support_px - FADE) / (1 - FADE), 0, 1)
    return np.asarray(np.cos(np.pi / 2 * outward) ** 2)


@lru_cache(maxsize=8)
def _series(psf: LensPSF) -> _CosineSeries:
    period = 2.0 * psf.support_px
    cutoff = 1 / min(width for width, _ in psf.airy_widths)
    frequencies = np.arange(math.floor(period * cutoff) + 1) / period
    amplitudes = psf.otf(frequencies[:, None], frequencies)
    pixels = np.arange(-psf.support_px, psf.support_px + 1.0)
    sums = _CosineSeries(period, frequencies, amplitudes).cosines(pixels).sum(axis=0)
    return _CosineSeries(period, frequencies, amplitudes / (sums @ amplitudes @ sums))


@lru_cache(maxsize=8)
def _low_rank(psf: LensPSF) -> tuple[Floats, Floats]:
    """Return weights (TERMS + 1,) and cosine amplitudes (n, TERMS + 1) of the separable terms.

    The first TERMS belong to the largest eigenvalues of the amplitudes. The last one restores the sums along both axes.
    """
    series = _series(psf)
    values, vectors = np.linalg.eigh(series.amplitudes)
    largest = np.argsort(-np.abs(values))[:TERMS]
    weights, vectors = values[largest], vectors[:, largest]
    sums = series.cosines(np.arange(-psf.support_px, psf.support_px + 1.0)).sum(axis=0)
    lacking = series.amplitudes @ sums - vectors @ (weights * (sums @ vectors))
    return np.append(weights, 1 / (sums @ lacking)), np.column_stack([vectors, lacking])


@lru_cache(maxsize=64)
def _separable_kernels(psf: LensPSF, fine: int) -> tuple[KernelTerm, ...]:
    series, (weights, vectors), support = _series(psf), _low_rank(psf), psf.support_px
    offsets = np.arange(-support, support + 1) - ((np.arange(fine) + 0.5) / fine - 0.5)[:, None]  # pixels from cells
    even, rising = (
        np.ascontiguousarray((waves @ vectors).T).reshape(-1, *offsets.shape)
        for waves in (series.cosines(offsets.ravel(), fine), series.slopes(offsets.ravel(), fine))
    )
    return tuple(zip(weights.tolist(), read_only(even), read_only(rising), strict=True))


@lru_cache(maxsize=64)
def _fwhm_px(psf: LensPSF) -> float:
    def light(offset: float) -> float:
        return float(psf.pixel_integral(np.zeros(1), np.array([offset]))[0, 0])

    return full_width(light, float(psf.support_px), 50)


@dataclass(frozen=True)
class WingedLensPSF(LensPSF):
    """Lens PSF with far wings, for a point bright enough to show them.

    The share of an Airy pattern's light outside radius r is J0^2 + J1^2 at pi r / w, w its width (Born and Wolf,
    Principles of Optics, sec. 8.5.2), for large r 2 w / (pi^2 r). So a pixel at r has the share w / (pi^3 r^3); the
    rings average out over a band. The cosine series contains the wings of its periodic images; these are subtracted.
    """

    @property
    def support_px(self) -> int:
        return WING_SUPPORTS * super().support_px

    def pixel_integral(self, rows: Floats, columns: Floats) -> Floats:
        return _winged_integral(self, rows, columns) / _winged_sum(replace(self, sigma_px=0.0))

    @property
    def core(self) -> LensPSF:
        """The cosine series, on its own support."""
        return LensPSF(self.airy_widths, self.defocus_px, self.sigma_px)

    @property
    def mean_airy_width_px(self) -> float:
        """Mean wavelength times F-number, px."""
        return sum(width * weight for width, weight in self.airy_widths)


def with_wings(psf: PSF, share: float) -> PSF:
    """Return the PSF, with far wings if a pixel at the end of its support receives more than `share` of a point's
    light."""
    if not isinstance(psf, LensPSF):
        return psf  # a Gaussian has no wings
    winged = WingedLensPSF(psf.airy_widths, psf.defocus_px, psf.sigma_px)
    return winged if winged.mean_airy_width_px > share * (math.pi * psf.support_px) ** 3 else psf


def _winged_integral(psf: WingedLensPSF, rows: Floats, columns: Floats) -> Floats:
    core, period = psf.core, 2.0 * psf.core.support_px
    strength = psf.mean_airy_width_px / math.pi**3
    ends = [fade(at, psf.support_px)[:, None] for at in (rows, columns)]
    floor = (core.support_px / 2) ** 2  # wings are unused farther in; avoids division by 0
    square = np.maximum(np.add.outer(rows**2, columns**2), floor)
    wings = _inverse_cube(square) * (strength * ends[0] @ ends[1].T)
    within = [np.flatnonzero(np.abs(at) <= core.support_px) for at in (rows, columns)]
    if within[0].size and within[1].size:
        down, across = rows[within[0]], columns[within[1]]
        own = np.outer(fade(down, core.support_px), fade(across, core.support_px))
        images = sum(
            _inverse_cube(np.add.outer((down - m * period) ** 2, (across - n * period) ** 2)) for m, n in NEAR_PERIODS
        )
        patch = np.ix_(*within)
        wings[patch] *= 1 - own
        wings[patch] += core.pixel_integral(down, across) - own * strength * (images + _FAR_PERIODS / period**3)
    return wings


def _inverse_cube(square: Floats) -> Floats:
    """Return r^-3 from `square` = r^2, ten times as fast as by a power."""
    return np.asarray(1 / (square * np.sqrt(square)))


@lru_cache(maxsize=8)
def _winged_sum(psf: WingedLensPSF) -> float:
    """Return the sum of the PSF over all pixels, which normalises it, without Gaussian blur: one value for all
    blurs."""
    pixels = np.arange(-psf.support_px, psf.support_px + 1.0)
    return float(_winged_integral(psf, pixels, pixels).sum())
