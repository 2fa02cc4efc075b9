"""What is done with periodic pictures as wholes: blurred, made smaller and larger."""

from __future__ import annotations

import cv2
import numpy as np

from irsim.types import Floats

FINE = 5.0
"""Sigma, px, of a blur after which a picture is still told well by its pixels: OpenCV's cubic through them misses a
hundredth of it."""


def wrapped_blur(texture: Floats, sigma_px: float) -> Floats:
    """A periodic texture (side, side), float32, after a Gaussian blur."""
    texture = np.asarray(texture, dtype=np.float32)
    if sigma_px == 0:
        return texture
    reach = min(int(np.ceil(5 * sigma_px)), texture.shape[0])
    wide = cv2.copyMakeBorder(texture, reach, reach, reach, reach, cv2.BORDER_WRAP)
    soft = cv2.GaussianBlur(wide, (2 * reach + 1, 2 * reach + 1), sigma_px)
    return np.ascontiguousarray(soft[reach:-reach, reach:-reach])


LEAST = 16
"""Side, px, below which no picture is made smaller."""


def coarseness(sigma_px: float, side: int) -> int:
    """How many times smaller a picture of that side may be made that is blurred so much anyway: a power of two."""
    return 1 << max(int(np.log2(min(sigma_px / FINE, side / LEAST))), 0)


def shrunk(texture: Floats, coarse: int) -> Floats:
    """(side / coarse, side / coarse) float32: the means of squares of (side, side)."""
    side = texture.shape[0] // coarse
    return np.asarray(cv2.resize(texture, (side, side), interpolation=cv2.INTER_AREA))


def enlarged(texture: Floats, coarse: int) -> Floats:
    """(side coarse, side coarse) float32 of a periodic (side, side): a cubic between its pixels."""
    if coarse == 1:
        return texture
    reach = 2  # of a cubic
    wide = cv2.copyMakeBorder(texture, reach, reach, reach, reach, cv2.BORDER_WRAP)
    large = cv2.resize(wide, None, fx=coarse, fy=coarse, interpolation=cv2.INTER_CUBIC)
    cut = slice(reach * coarse, -reach * coarse)
    return np.ascontiguousarray(large[cut, cut])
