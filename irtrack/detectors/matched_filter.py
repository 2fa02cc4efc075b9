"""`matched_filter`: a point's image in clutter whose covariance is that of the frame's own patches."""

from __future__ import annotations

from math import erf, sqrt
from typing import ClassVar

import cv2
import numpy as np

from irsim.types import Floats
from irtrack.detectors.base import Side, SingleFrameDetector, Width
from irtrack.detectors.peaks import ROUNDING, Picture

PATCHES = 3000
"""Number of patches sampled for a covariance: 60 times the 49 pixels of a patch, for a loss of .1 dB SNR (Reed et al.
1974)."""


class MatchedFilter(SingleFrameDetector):
    """Matched filter whitened by the clutter's covariance between neighbouring pixels, h = C^-1 s / sqrt(s' C^-1 s).

    F. Robey, D. Fuhrmann, E. Kelly, R. Nitzberg, "A CFAR adaptive matched filter detector", IEEE TAES 28(1), 1992,
    eq. 8, with C of the frame's patches, each less its mean: an unknown level is projected out. s is a point's image,
    a normal curve integrated over pixels. A target that lies in the sampled patches adds itself to C, which bounds z
    by about sqrt(PATCHES).
    """

    source: ClassVar[str] = "Robey, Fuhrmann, Kelly, Nitzberg 1992"

    psf: Width = 1.0
    """Standard deviation of a point's image, px."""
    side: Side = 7
    """Side of the patch, px, odd."""

    @property
    def smoothing(self) -> float:
        return self.psf

    @property
    def reach(self) -> int:
        return self.side // 2 + 1

    def response(self, picture: Picture) -> Picture:
        kernel = whitened(clutter_covariance(picture, self.side), point_image(self.psf, self.side))
        return cv2.filter2D(picture, cv2.CV_32F, kernel.astype(np.float32))  # type: ignore[return-value]  # OpenCV's stubs know no element types


def point_image(psf: float, side: int) -> Floats:
    """Return a point's image (side, side): a normal curve of standard deviation psf integrated over pixels."""
    edges = [erf((k - side / 2) / (sqrt(2) * psf)) / 2 for k in range(side + 1)]
    line = np.diff(edges)
    return np.outer(line, line)


def clutter_covariance(picture: Picture, side: int) -> Floats:
    """Return the covariance (side^2, side^2) of patches less their means, counts^2.

    The variance of rounding is added on the diagonal, and the mean variance to the level of a patch, so that the matrix
    has an inverse.
    """
    if min(picture.shape) < 2 * side:  # only small pictures are padded: mirrored clutter has a bend at the edge
        picture = np.pad(picture, side // 2, mode="reflect" if min(picture.shape) > side // 2 else "edge")
    step = max(int(sqrt(picture.size / PATCHES)), 1)
    windows = np.lib.stride_tricks.sliding_window_view(picture, (side, side))[::step, ::step]
    patches = windows.reshape(-1, side * side)  # a copy
    patches = patches - patches.mean(axis=1, keepdims=True)
    covariance = (patches.T @ patches).astype(np.float64) / len(patches)
    size = side * side
    loaded: Floats = covariance + ROUNDING**2 * np.eye(size) + np.trace(covariance) / size**2
    return loaded


def whitened(covariance: Floats, signature: Floats) -> Floats:
    """Return the filter (side, side) whose response to the clutter has unit deviation; its sum is 0."""
    s = (signature - signature.mean()).ravel()
    h = np.linalg.solve(covariance, s)
    return (h / sqrt(float(s @ h))).reshape(signature.shape)
