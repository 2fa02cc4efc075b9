"""Point spread functions: the base class, and the Gaussian, integrated over pixels in closed form."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from irsim.types import Floats, read_only

SUPPORT_SIGMAS = 6.0
"""Half width, in sigmas, of the area on which a Gaussian is drawn: 2e-9 of its light falls outside."""

KernelTerm = tuple[float, Floats, Floats]
"""A weight and two (fine, 2 support + 1) arrays: see `PSF.separable_kernels`."""

_erf = np.frompyfunc(math.erf, 1, 1)  # importing scipy.special would cost 0.3 s in every process


class PSF(ABC):
    """Distribution of a point's light over pixels, integrated over each pixel; its sum is 1."""

    @property
    @abstractmethod
    def support_px(self) -> int:
        """Half width of the drawn area: whole pixels to each side of the point's own pixel."""

    @property
    @abstractmethod
    def fwhm_px(self) -> float:
        """Full width at half maximum of the pixel-integrated PSF, px."""

    @abstractmethod
    def otf(self, down: Floats, across: Floats) -> Floats:
        """Return the optical transfer function, without that of the pixel, at frequencies along both axes, cycles/px.

        Arrays broadcast; the value at 0 is 1.
        """

    @abstractmethod
    def pixel_integral(self, rows: Floats, columns: Floats) -> Floats:
        """Return the share of a point's light, (n, m), on pixels with centres `rows` (n,) px below and `columns` (m,)
        px right of it."""

    @abstractmethod
    def broadened(self, sigma_px: float) -> PSF:
        """Return this PSF convolved with a Gaussian of `sigma_px`."""

    @abstractmethod
    def separable_kernels(self, fine: int) -> Sequence[KernelTerm]:
        """Return kernels that blur the cells of a pixel, `fine` a side, and bin them to pixels.

        The PSF is a sum of separable terms, sum of weight_k s_k(y) s_k(x). For each term and cell the first array holds
        s_k for light spread evenly over the cell. The second array holds s_k for light linear across the cell with a
        first moment of one (light times cells from the cell's centre). Read only.
        """


@dataclass(frozen=True)
class GaussianPSF(PSF):
    """Gaussian PSF of `sigma_px`, in closed form; at sigma 0 a point lights one pixel."""

    sigma_px: float

    @cached_property
    def support_px(self) -> int:
        return math.ceil(SUPPORT_SIGMAS * self.sigma_px + 0.5) if self.sigma_px else 0

    @cached_property
    def fwhm_px(self) -> float:
        """1 px without blur, 2.355 sigma in the limit of wide blur."""
        return _gaussian_width(self.sigma_px)

    def otf(self, down: Floats, across: Floats) -> Floats:
        return np.asarray(np.exp(-2 * np.pi**2 * self.sigma_px**2 * (down**2 + across**2)))

    def pixel_integral(self, rows: Floats, columns: Floats) -> Floats:
        return np.outer(gaussian_integral(rows, self.sigma_px), gaussian_integral(columns, self.sigma_px))

    def broadened(self, sigma_px: float) -> GaussianPSF:
        return GaussianPSF(math.hypot(self.sigma_px, sigma_px))

    def separable_kernels(self, fine: int) -> Sequence[KernelTerm]:
        return [(1.0, *gaussian_kernels(self.support_px, fine, self.sigma_px))]


@lru_cache(maxsize=64)
def _gaussian_width(sigma_px: float) -> float:
    return full_width(
        lambda offset: float(gaussian_integral(np.array([offset]), sigma_px)[0]), 1.0 + 2.5 * sigma_px, 60
    )


def gaussian_integral(offsets: Floats, sigma_px: float) -> Floats:
    """Return the integral of a Gaussian over [offset - 1/2, offset + 1/2], on one axis, px.

    The two-dimensional share is the product over both axes. Sigma 0 gives all light to the pixel that holds the point.
    """
    offsets = np.asarray(offsets, dtype=np.float64)
    if sigma_px == 0:
        return ((offsets > -0.5) & (offsets <= 0.5)).astype(np.float64)
    scale = 1 / (sigma_px * math.sqrt(2))
    upper, lower = _erf((offsets + 0.5) * scale), _erf((offsets - 0.5) * scale)
    return np.asarray((upper - lower) / 2, dtype=np.float64)


def full_width(light: Callable[[float], float], high: float, halvings: int) -> float:
    """Return the full width at half maximum of `light`, which falls with the offset from 0 to `high`, by bisection."""
    low, half = 0.0, light(0.0) / 2
    for _ in range(halvings):
        middle = (low + high) / 2
        low, high = (middle, high) if light(middle) > half else (low, middle)
    return low + high


@lru_cache(maxsize=64)
def gaussian_kernels(support: int, fine: int, sigma_px: float) -> tuple[Floats, Floats]:
    """Return two (fine, 2 support + 1) kernels for `PSF.separable_kernels`, on one axis.

    Both are closed integrals of the Gaussian over cell and pixel. Rows of the first sum to one, of the second to zero,
    and mirrored cells have mirrored rows: light is conserved and centroids stay. Read only.
    """
    # Offsets of pixels from cells, px.
    offsets = np.arange(-support, support + 1) - ((np.arange(fine) + 0.5) / fine - 0.5)[:, None]
    ahead, behind = offsets + 0.5 / fine, offsets - 0.5 / fine
    once_ahead, twice_ahead = _pixel_antiderivatives(ahead, sigma_px)
    once_behind, twice_behind = _pixel_antiderivatives(behind, sigma_px)
    even = (once_ahead - once_behind) * fine
    slope = 12 * ((twice_ahead - twice_behind) * fine**2 - (once_ahead + once_behind) * fine / 2)
    far = np.abs(offsets) > SUPPORT_SIGMAS * sigma_px + 1  # exactly 0, but for rounding
    even[far] = slope[far] = 0.0
    total = even.sum(axis=1, keepdims=True)
    slope = slope / total - even * slope.sum(axis=1, keepdims=True) / total**2
    even /= total
    return read_only(even), read_only(slope)


def _pixel_antiderivatives(offsets: Floats, sigma: float) -> tuple[Floats, Floats]:
    """Return the first and second antiderivative of `gaussian_integral`."""
    (once_above, twice_above), (once_below, twice_below) = (
        _normal_antiderivatives(offsets + side, sigma) for side in (0.5, -0.5)
    )
    return once_above - once_below, twice_above - twice_below


def _normal_antiderivatives(x: Floats, sigma: float) -> tuple[Floats, Floats]:
    """Return the first and second antiderivative of the normal distribution function of standard deviation `sigma`."""
    if sigma == 0:
        ramp = np.maximum(x, 0.0)
        return ramp, ramp**2 / 2
    below = np.asarray((1 + _erf(x / (sigma * math.sqrt(2)))) / 2, dtype=np.float64)
    density = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
    return x * below + sigma**2 * density, ((x**2 + sigma**2) * below + x * sigma**2 * density) / 2
