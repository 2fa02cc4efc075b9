"""The far wings of a lens's spread, beyond where it is drawn as a sum of cosines: an Airy pattern without its rings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from irsim.physics.diffraction import LensPSF, faded
from irsim.physics.psf import PSF
from irsim.types import Floats

TIMES = 4
"""How many times as far as the sum of cosines they are drawn: at their end they have fallen to a 64th."""

LATTICE = 9.03362
"""Sum of (m^2 + n^2)^(-3/2) over all whole m and n but (0, 0): 4 zeta(3/2) beta(3/2)."""

NEXT = [(m, n) for m in range(-2, 3) for n in range(-2, 3) if (m, n) != (0, 0)]
"""Repetitions of the cosines whose wings are taken one by one."""

_REST = LATTICE - sum((m * m + n * n) ** -1.5 for m, n in NEXT)


@dataclass(frozen=True)
class Winged(LensPSF):
    """A lens's spread with its far wings, for a point so bright that they show.

    Outside r the Airy pattern of width w = wavelength x F-number has J0^2 + J1^2 of pi r / w of its light (Born and
    Wolf, Principles of Optics, sec. 8.5.2), for large arguments 2 w / (pi^2 r): so a pixel there has w / (pi^3 r^3),
    rings aside, which run together over a band. The cosines, which repeat, have the wings of their repetitions laid
    over what is drawn: these are taken off.
    """

    @property
    def reach_px(self) -> int:
        return TIMES * super().reach_px

    def share(self, rows: Floats, columns: Floats) -> Floats:
        return _bare(self, rows, columns) / _light(replace(self, sigma_px=0.0))

    @property
    def near(self) -> LensPSF:
        """The sum of cosines, as far as it goes."""
        return LensPSF(self.colours, self.defocus_px, self.sigma_px)

    @property
    def width_px(self) -> float:
        """Wavelength times F-number."""
        return sum(width * weight for width, weight in self.colours)


def reaching(spread: PSF, share: float) -> PSF:
    """The spread, with far wings where it ends in pixels that have more than that share of a point's light."""
    if not isinstance(spread, LensPSF):
        return spread  # a Gaussian ends in next to nothing
    winged = Winged(spread.colours, spread.defocus_px, spread.sigma_px)
    return winged if winged.width_px > share * (math.pi * spread.reach_px) ** 3 else spread


def _bare(spread: Winged, rows: Floats, columns: Floats) -> Floats:
    near, period = spread.near, 2.0 * spread.near.reach_px
    strength = spread.width_px / math.pi**3
    ends = [faded(at, spread.reach_px)[:, None] for at in (rows, columns)]
    core = (near.reach_px / 2) ** 2  # further in there are none; none is divided by 0 there
    square = np.maximum(np.add.outer(rows**2, columns**2), core)
    wings = _falling(square) * (strength * ends[0] @ ends[1].T)
    within = [np.flatnonzero(np.abs(at) <= near.reach_px) for at in (rows, columns)]
    if within[0].size and within[1].size:
        down, across = rows[within[0]], columns[within[1]]
        own = np.outer(faded(down, near.reach_px), faded(across, near.reach_px))
        laid_over = sum(_falling(np.add.outer((down - m * period) ** 2, (across - n * period) ** 2)) for m, n in NEXT)
        patch = np.ix_(*within)
        wings[patch] *= 1 - own
        wings[patch] += near.share(down, across) - own * strength * (laid_over + _REST / period**3)
    return wings


def _falling(square: Floats) -> Floats:
    """r^-3 of r^2, in a tenth of a power's time."""
    return np.asarray(1 / (square * np.sqrt(square)))


@lru_cache(maxsize=8)
def _light(spread: Winged) -> float:
    """All that falls on the pixels about a point in the middle of one: by the lens alone, not kept for each blur."""
    pixels = np.arange(-spread.reach_px, spread.reach_px + 1.0)
    return float(_bare(spread, pixels, pixels).sum())
