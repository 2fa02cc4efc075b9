"""What the lens makes of a background's pictures.

Their pixels are means over pixels already: what is laid over them here is the lens's transfer function alone, without
that of a pixel. A Gaussian lens is drawn as OpenCV draws Gaussians where a picture does not repeat, any other by its
kernel: ten times as slow, and no slower for one that is wider.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from irsim.backgrounds.periodic import inner_blur, reach_px
from irsim.physics.psf import PSF, GaussianPSF
from irsim.types import Floats


def blurred(texture: Floats, psf: PSF, texels: int = 1) -> Floats:
    """A periodic texture (rows, columns), as float32, seen by a lens whose pixels are so many texels wide."""
    passed = _passed(psf, texture.shape[0], texture.shape[1], texels)
    if np.ptp(texture) == 0:  # what is even stays so, to the last bit: of a flat ground, half of the work
        return np.full(texture.shape, np.float64(texture[0, 0]) * passed[0, 0], np.float32)
    return np.fft.irfft2(np.fft.rfft2(texture) * passed, s=texture.shape).astype(np.float32)


@lru_cache(maxsize=1)
def _passed(psf: PSF, rows: int, columns: int, texels: int) -> Floats:
    """What passes of each frequency of `rfft2`; kept, as textures of one shape are blurred one after another."""
    return psf.otf(texels * np.fft.fftfreq(rows)[:, None], texels * np.fft.rfftfreq(columns)[None, :])


def softened(picture: Floats, psf: PSF) -> Floats:
    """A picture (rows, columns) of floats, whose outermost pixels go on beyond its edges, seen by a lens."""
    if not isinstance(psf, GaussianPSF):
        return np.asarray(cv2.filter2D(picture, -1, _kernel(psf), borderType=cv2.BORDER_REPLICATE))
    if psf.sigma_px == 0:
        return picture
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), psf.sigma_px, borderType=cv2.BORDER_REPLICATE))


def margin_px(psf: PSF, side: int) -> int:
    """How far about each pixel of (side, side) a lens looks, px."""
    return reach_px(psf.sigma_px, side) if isinstance(psf, GaussianPSF) else min(psf.support_px, side)


def inner(wide: Floats, psf: PSF, margin: int) -> Floats:
    """What a lens leaves of a picture, float32, without a margin as wide as it looks."""
    if isinstance(psf, GaussianPSF):
        return inner_blur(wide, psf.sigma_px, margin)
    return softened(wide, psf)[margin:-margin, margin:-margin]


@lru_cache(maxsize=4)
def _kernel(psf: PSF) -> Floats:
    """(n, n) float32, n = 2 reach + 1: what has that transfer function at the n frequencies of either axis.

    What lies beyond its reach is laid over it, as over what targets are drawn with.
    """
    side = 2 * psf.support_px + 1
    passed = psf.otf(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    return np.fft.fftshift(np.fft.irfft2(passed, s=(side, side))).astype(np.float32)
