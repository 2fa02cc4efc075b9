"""Detectors by linear high-pass and band-pass filters: `dog`, `ring`, `butterworth`."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irtrack.detectors.base import FilterDetector, SingleFrameDetector, Width
from irtrack.detectors.peaks import Picture
from irtrack.features.frequency import first_cutoff, passed, spectrum_of
from irtrack.features.highpass import predicted_background, ring_kernel


class DoG(SingleFrameDetector):
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


class Ring(SingleFrameDetector):
    """The frame less the mean of a ring neighbourhood.

    D. Xue, J. Yuan, Y. Xie 2011, eq. 1 (see `irtrack.features.highpass`), computed at every pixel.
    """

    source: ClassVar[str] = "Xue, Yuan, Xie 2011, eq. 1"

    L: int = Field(default=4, ge=1, le=31)
    """Largest radius, px; the paper gives no value."""
    m: int = Field(default=8, ge=3, le=64)
    """Samples on each radius; the paper gives no value."""
    inner: int = Field(default=0, ge=0, le=31)
    """Least radius, px; 0 in the paper. A radius above half the target's size keeps the target out of its
    background."""

    @property
    def reach(self) -> int:
        return self.L

    def response(self, picture: Picture) -> Picture:
        kernel = ring_kernel(self.L, self.m, min(self.inner, self.L))
        return picture - predicted_background(picture, kernel, 1)


class Butterworth(FilterDetector):
    """High-pass filter in the frequency domain, H = 1 / (1 + (D0 / D)^(2 n)).

    R. Gonzalez, R. Woods, "Digital Image Processing", 3rd ed. 2008, eq. 4.9-3 (see `irtrack.features.frequency`). By
    default D0 is the one of its `CUTOFFS` whose response to the first frame has the largest kurtosis. The memory is D0.
    """

    source: ClassVar[str] = "Gonzalez, Woods 2008, eq. 4.9-3"

    cutoff: Annotated[float | None, Field(gt=0, le=0.7)] = None
    """D0, cycles/px; by default the D0 of the largest kurtosis in the first frame."""
    order: int = Field(default=2, ge=1, le=10)
    """Order n of the filter."""

    def respond(self, memory: float | None, picture: Picture) -> tuple[Any, Picture]:
        spectrum = spectrum_of(picture)
        cutoff = self.cutoff or memory or first_cutoff(spectrum, self.order)
        return cutoff, passed(spectrum, cutoff, self.order)
