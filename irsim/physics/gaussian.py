"""The optical blur: a Gaussian point spread, integrated over pixels in closed form."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from irsim.types import Floats

REACH = 6.0
"""Sigmas that a point spread is drawn to: 2e-9 of its light falls outside."""

_erf = np.frompyfunc(math.erf, 1, 1)  # importing scipy.special would cost 0.3 s in every process


def shares(offsets: Floats, sigma_px: float) -> Floats:
    """Share of a point's light that falls on pixels whose centres lie at `offsets` px from it, on one axis.

    The integral of a Gaussian over [offset - 1/2, offset + 1/2]; the two-dimensional share is the
    product of both axes. Sigma 0 gives all to the one pixel that holds the point.
    """
    offsets = np.asarray(offsets, dtype=np.float64)
    if sigma_px == 0:
        return ((offsets > -0.5) & (offsets <= 0.5)).astype(np.float64)
    scale = 1 / (sigma_px * math.sqrt(2))
    upper, lower = _erf((offsets + 0.5) * scale), _erf((offsets - 0.5) * scale)
    return np.asarray((upper - lower) / 2, dtype=np.float64)


def reach_px(sigma_px: float) -> int:
    """Whole pixels to each side of a point's own pixel that its spread is drawn to."""
    return math.ceil(REACH * sigma_px + 0.5) if sigma_px else 0


@lru_cache(maxsize=256)
def fwhm_px(sigma_px: float) -> float:
    """Full width at half maximum, px, of a point's light as pixels see it (blur and pixel together).

    1 px without blur, the Gaussian's 2.355 sigma where it is wide.
    """
    low, high = 0.0, 1.0 + 2.5 * sigma_px
    half = _density(0.0, sigma_px) / 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _density(middle, sigma_px) > half else (low, middle)
    return low + high


def _density(offset: float, sigma_px: float) -> float:
    return float(shares(np.array([offset]), sigma_px)[0])


@lru_cache(maxsize=64)
def spreading(reach: int, fine: int, sigma_px: float) -> tuple[Floats, Floats]:
    """Two (fine, 2 reach + 1) arrays that blur the cells of a pixel and bin them to pixels, on one axis.

    Row c of the first holds how light that fills cell c evenly falls on the pixel and `reach` more on either side;
    row c of the second, what a first moment of one (light times cells from the cell's middle) adds, the
    light taken to rise linearly through the cell. Both are closed integrals of the Gaussian over cell
    and pixel. Rows of the first sum to one, of the second to zero, and mirrored cells have mirrored
    rows: light is conserved and centroids stay. Read only.
    """
    # Of pixels from cells, px.
    offsets = np.arange(-reach, reach + 1) - ((np.arange(fine) + 0.5) / fine - 0.5)[:, None]
    ahead, behind = offsets + 0.5 / fine, offsets - 0.5 / fine
    once_ahead, twice_ahead = _integrals(ahead, sigma_px)
    once_behind, twice_behind = _integrals(behind, sigma_px)
    even = (once_ahead - once_behind) * fine
    slope = 12 * ((twice_ahead - twice_behind) * fine**2 - (once_ahead + once_behind) * fine / 2)
    far = np.abs(offsets) > REACH * sigma_px + 1  # differences of large numbers: nothing but rounding
    even[far] = slope[far] = 0.0
    total = even.sum(axis=1, keepdims=True)
    slope = slope / total - even * slope.sum(axis=1, keepdims=True) / total**2
    even /= total
    even.setflags(write=False)
    slope.setflags(write=False)
    return even, slope


def _integrals(offsets: Floats, sigma: float) -> tuple[Floats, Floats]:
    """The first and the second integral of `shares` by the offset."""
    (once_above, twice_above), (once_below, twice_below) = (_ramps(offsets + side, sigma) for side in (0.5, -0.5))
    return once_above - once_below, twice_above - twice_below


def _ramps(x: Floats, sigma: float) -> tuple[Floats, Floats]:
    """The first and the second integral of the normal distribution function of that sigma."""
    if sigma == 0:
        ramp = np.maximum(x, 0.0)
        return ramp, ramp**2 / 2
    below = np.asarray((1 + _erf(x / (sigma * math.sqrt(2)))) / 2, dtype=np.float64)
    density = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
    return x * below + sigma**2 * density, ((x**2 + sigma**2) * below + x * sigma**2 * density) / 2
