"""Orientation of the grey levels' gradient, in bins, and its magnitude (Li, Li 2014, section 3.3).

G = sqrt(Gx^2 + Gy^2),  theta = arctan(Gy / Gx),  Gx, Gy from the Sobel operators
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Image
from irtrack.features.quantise import Bins

Gradient = npt.NDArray[np.float32]


def sobel(image: Image, left: int, top: int, right: int, bottom: int) -> tuple[Gradient, Gradient]:
    """Gx, Gy of the part [top:bottom, left:right] of a frame, (bottom - top, right - left) each.

    In counts times 4, the sum of an operator's positive weights. Beyond the frame's edge its last
    pixels go on.
    """
    height, width = image.shape
    inner_left, inner_top = max(left - 1, 0), max(top - 1, 0)
    around = image[inner_top : min(bottom + 1, height), inner_left : min(right + 1, width)]
    part = np.s_[top - inner_top : bottom - inner_top, left - inner_left : right - inner_left]
    gx = cv2.Sobel(around, cv2.CV_32F, 1, 0, borderType=cv2.BORDER_REPLICATE)
    gy = cv2.Sobel(around, cv2.CV_32F, 0, 1, borderType=cv2.BORDER_REPLICATE)
    return np.ascontiguousarray(gx[part]), np.ascontiguousarray(gy[part])


def polar(gx: Gradient, gy: Gradient) -> tuple[Gradient, Gradient]:
    """Magnitudes G and directions theta, 0 to 2 pi from +x towards +y, both of the shape of gx and gy."""
    if gx.size == 0:
        return gx, gy
    magnitude: Gradient
    angle: Gradient
    magnitude, angle = cv2.cartToPolar(gx.reshape(len(gx), -1), gy.reshape(len(gy), -1))  # type: ignore[assignment]  # OpenCV's stubs know no element types
    return magnitude.reshape(gx.shape), angle.reshape(gx.shape)


def orientations(gx: Gradient, gy: Gradient, bins: int) -> tuple[Bins, Gradient]:
    """Bins 0 .. bins-1 of theta and magnitudes G, both of the shape of gx and gy.

    Bin u is centred on the direction 2 pi u / bins from +x towards +y: the edges of upright things
    lie in the middle of a bin and not between two. Directions are told over the whole circle, so
    that the two sides of a target differ.
    """
    magnitude, angle = polar(gx, gy)
    angle *= bins / (2 * np.pi)
    angle += 0.5
    cells = angle.astype(np.intp)
    cells[cells >= bins] = 0  # the last half bin before the full circle belongs to the first
    return cells, magnitude
