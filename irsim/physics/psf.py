"""What drawing may ask of a point spread; the Gaussian one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.physics.gaussian import fwhm_px, reach_px, shares, spreading
from irsim.types import Floats

Term = tuple[float, Floats, Floats]
"""A weight, and two (fine, 2 reach + 1) arrays: see `PSF.spreading`."""


class PSF(ABC):
    """How the light of a point falls on pixels: integrated over each of them, 1 in all."""

    @property
    @abstractmethod
    def reach_px(self) -> int:
        """Whole pixels to each side of a point's own pixel that its spread is drawn to."""

    @property
    @abstractmethod
    def fwhm_px(self) -> float:
        """Full width at half maximum, px, of a point's light as pixels see it."""

    @abstractmethod
    def transfer(self, down: Floats, across: Floats) -> Floats:
        """The transfer function of the lens alone, without that of a pixel, at spatial frequencies along both axes,
        cycles a px (arrays broadcast): what is left of a wave's amplitude, 1 at 0."""

    @abstractmethod
    def share(self, rows: Floats, columns: Floats) -> Floats:
        """(n, m) share of a point's light on pixels whose centres lie `rows` (n,) px below, `columns` (m,) px right."""

    @abstractmethod
    def wider(self, sigma_px: float) -> PSF:
        """The same with a Gaussian of that sigma beside it."""

    @abstractmethod
    def spreading(self, fine: int) -> Sequence[Term]:
        """How the cells of a pixel, `fine` a side, are blurred and binned to pixels: its own and `reach_px` more on
        either side.

        The spread is a sum of products, one axis each: sum of weight_k s_k(y) s_k(x). Of each term and cell the
        arrays hold s_k for light that fills the cell evenly, and for a first moment of one (light times
        cells from the cell's middle), the light rising linearly through the cell. Read only.
        """


@dataclass(frozen=True)
class GaussianPSF(PSF):
    """A Gaussian of `sigma_px`, in closed form; 0 leaves the pixel alone."""

    sigma_px: float

    @cached_property
    def reach_px(self) -> int:
        return reach_px(self.sigma_px)

    @property
    def fwhm_px(self) -> float:
        return fwhm_px(self.sigma_px)

    def transfer(self, down: Floats, across: Floats) -> Floats:
        return np.asarray(np.exp(-2 * np.pi**2 * self.sigma_px**2 * (down**2 + across**2)))

    def share(self, rows: Floats, columns: Floats) -> Floats:
        return np.outer(shares(rows, self.sigma_px), shares(columns, self.sigma_px))

    def wider(self, sigma_px: float) -> GaussianPSF:
        return GaussianPSF(math.hypot(self.sigma_px, sigma_px))

    def spreading(self, fine: int) -> Sequence[Term]:
        return [(1.0, *spreading(self.reach_px, fine, self.sigma_px))]
