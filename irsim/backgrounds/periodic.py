"""What is done with periodic pictures as wholes: blurred, made smaller and larger."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from irsim.types import Floats

FINE = 2.5
"""Sigma, px, of a blur after which a picture is still told well by its pixels: of slopes of clouds (beta 3.3) OpenCV's
cubic through them misses a fiftieth, rms. A sigma of 5 px would miss a hundredth, in nine times the time."""


def reach_px(sigma_px: float, side: int) -> int:
    """How far about each pixel of (side, side) a Gaussian blur looks, px."""
    return min(int(np.ceil(5 * sigma_px)), side)


def wrapped_blur(texture: Floats, sigma_px: float) -> Floats:
    """A periodic texture (rows, columns), float32, after a Gaussian blur."""
    texture = np.asarray(texture, dtype=np.float32)
    reach = reach_px(sigma_px, min(texture.shape))
    wide = np.asarray(cv2.copyMakeBorder(texture, reach, reach, reach, reach, cv2.BORDER_WRAP), dtype=np.float32)
    return inner_blur(wide, sigma_px, reach)


def inner_blur(wide: Floats, sigma_px: float, reach: int) -> Floats:
    """What a Gaussian blur leaves of a picture, float32, without a margin as wide as it reaches."""
    if reach == 0:
        return wide
    soft = cv2.GaussianBlur(wide, (2 * reach + 1, 2 * reach + 1), sigma_px)
    return np.asarray(soft[reach:-reach, reach:-reach])


def window(texture: Floats, rows: slice, columns: slice) -> Floats:
    """A part of a periodic texture (rows, columns) or (rows, columns, channels); it may reach past its edges."""
    down, across = (list(_pieces(*part)) for part in zip((rows, columns), texture.shape[:2], strict=True))
    strips = [[texture[piece, beside] for beside in across] for piece in down]
    if len(down) == len(across) == 1:
        return strips[0][0]
    return np.concatenate([np.concatenate(strip, axis=1) for strip in strips])


def _pieces(part: slice, period: int) -> Iterator[slice]:
    """A stretch as parts of the period, one after another."""
    begin = part.start
    while begin < part.stop:
        first = begin % period
        last = min(first + part.stop - begin, period)
        yield slice(first, last)
        begin += last - first


LEAST = 16
"""Side, px, below which no picture is made smaller."""


def coarseness(sigma_px: float, side: int) -> int:
    """How many times smaller a picture of that side may be made that is blurred so much anyway: a power of two."""
    return 1 << max(int(np.log2(min(sigma_px / FINE, side / LEAST))), 0)


def shrunk(texture: Floats, coarse: int) -> Floats:
    """(rows / coarse, columns / coarse) float32: the means of squares of (rows, columns)."""
    rows, columns = (length // coarse for length in texture.shape[:2])
    return np.asarray(cv2.resize(texture, (columns, rows), interpolation=cv2.INTER_AREA))


CUBIC = 2
"""How far about each pixel a cubic between them looks, px."""


def enlarged(texture: Floats, coarse: int, rows: slice, columns: slice) -> Floats:
    """A part of a picture `coarse` times larger than a periodic (rows, columns), float32: a cubic between its pixels.
    The part may reach past the edges."""
    if coarse == 1:
        return window(texture, rows, columns)
    down, across = (slice(part.start // coarse - CUBIC, -(-part.stop // coarse) + CUBIC) for part in (rows, columns))
    large = cv2.resize(window(texture, down, across), None, fx=coarse, fy=coarse, interpolation=cv2.INTER_CUBIC)
    top, left = rows.start - down.start * coarse, columns.start - across.start * coarse
    return np.asarray(large[top : top + rows.stop - rows.start, left : left + columns.stop - columns.start])
