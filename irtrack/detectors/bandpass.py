"""Detectors by linear high-pass and band-pass filters: `dog`, `ring`, `butterworth`."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, ClassVar

import cv2
import numpy as np
from pydantic import Field
from scipy import fft

from irtrack.detectors.base import FilterDetector, Picture, Width
from irtrack.features.highpass import predicted_background, ring_kernel

CUTOFFS = tuple(0.02 * 2 ** (k / 2) for k in range(7))
"""Cut-off frequencies that `Butterworth` tries, cycles/px: .02 to .16, half the bandwidth of a point's image."""
SURE = 4.0
"""Number of standard errors by which a kurtosis must exceed another; for n normal pixels the error is sqrt(24 / n)."""


class DoG(FilterDetector):
    """Difference of two Gaussians, the inner one matched to the point spread function.

    D. Marr, E. Hildreth, "Theory of edge detection", Proc. R. Soc. B 207, 1980, appendix B: G(psf) - G(ratio psf); the
    ratio of 1.6 is their compromise between a Laplacian of a Gaussian and low noise.
    """

    source: ClassVar[str] = "Marr, Hildreth 1980"

    psf: Width = 1.0
    """Standard deviation of a point's image, px."""
    ratio: float = Field(default=1.6, gt=1, le=10)
    """Width of the outer Gaussian over that of the inner one."""

    @property
    def smoothing(self) -> float:
        return self.psf

    @property
    def reach(self) -> int:
        return max(round(4 * self.psf), 3)

    def response(self, picture: Picture) -> Picture:
        inner = cv2.GaussianBlur(picture, (0, 0), self.psf, borderType=cv2.BORDER_REFLECT_101)
        outer = cv2.GaussianBlur(picture, (0, 0), self.psf * self.ratio, borderType=cv2.BORDER_REFLECT_101)
        return np.subtract(inner, outer, dtype=np.float32)


class Ring(FilterDetector):
    """The frame less the mean of a ring neighbourhood.

    D. Xue, J. Yuan, Y. Xie 2011, eq. 1 (see `irtrack.features.highpass`), computed at every pixel.
    """

    source: ClassVar[str] = "Xue, Yuan, Xie 2011, eq. 1"

    L: int = Field(default=4, ge=1, le=31)
    """Largest radius, px; the source leaves it open."""
    m: int = Field(default=8, ge=3, le=64)
    """Samples on each radius; the source leaves it open."""
    inner: int = Field(default=0, ge=0, le=31)
    """Least radius, px; 0 in the source. A radius above half the target's size keeps the target out of its
    background."""

    @property
    def reach(self) -> int:
        return self.L

    def response(self, picture: Picture) -> Picture:
        kernel = ring_kernel(self.L, self.m, min(self.inner, self.L))
        return picture - predicted_background(picture, kernel, 1)


class Butterworth(FilterDetector):
    """High-pass filter in the frequency domain, H = 1 / (1 + (D0 / D)^(2 n)).

    R. Gonzalez, R. Woods, "Digital Image Processing", 3rd ed. 2008, eq. 4.9-3; named by Xue et al. 2011, section 1, as
    the costly way. D is the frequency. By default D0 is the one of `CUTOFFS` whose response to the first frame has the
    largest kurtosis, since sparse targets give long tails; the smallest D0 where the differences are within the noise.
    The filter uses the cosine transform (DCT-II), which mirrors the frame at its edges. The memory is D0.
    """

    source: ClassVar[str] = "Gonzalez, Woods 2008, eq. 4.9-3"

    cutoff: Annotated[float | None, Field(gt=0, le=0.7)] = None
    """D0, cycles/px; by default the D0 of the largest kurtosis in the first frame."""
    order: int = Field(default=2, ge=1, le=10)
    """Order n of the filter."""

    def respond(self, memory: float | None, picture: Picture) -> tuple[Any, Picture]:
        spectrum = fft.dctn(picture, norm="ortho")
        cutoff = self.cutoff or memory
        if cutoff is None:
            kurtoses = [_kurtosis(self._passed(spectrum, each)) for each in CUTOFFS]
            enough = max(kurtoses) - SURE * (24 / picture.size) ** 0.5
            cutoff = next(each for each, kurtosis in zip(CUTOFFS, kurtoses, strict=True) if kurtosis >= enough)
        return cutoff, self._passed(spectrum, cutoff)

    def _passed(self, spectrum: Picture, cutoff: float) -> Picture:
        passed = spectrum * butterworth(spectrum.shape, cutoff, self.order)
        response: Picture = fft.idctn(passed, norm="ortho", overwrite_x=True)
        return response


@lru_cache(maxsize=16)
def butterworth(shape: tuple[int, ...], cutoff: float, order: int) -> Picture:
    """Return H (rows, cols) at the frequencies k / (2 N) cycles/px of a cosine transform; 0 at frequency 0."""
    down, across = (np.arange(count) / (2 * count) for count in shape)
    squared = down[:, None] ** 2 + across**2
    squared[0, 0] = 1.0
    H = (1 / (1 + (cutoff**2 / squared) ** order)).astype(np.float32)
    H[0, 0] = 0.0
    H.setflags(write=False)
    return H


def _kurtosis(response: Picture) -> float:
    squares = np.square(response, dtype=np.float64)
    variance = squares.mean()
    return float(np.square(squares).mean() / variance**2) if variance > 1e-6 else 0.0
