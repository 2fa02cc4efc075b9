"""The plane of the ground, seen slantwise: textures laid on it, and what has edges."""

from __future__ import annotations

import math

import cv2
import numpy as np

from irsim.backgrounds.panorama import Sheet
from irsim.types import Floats

VANISHING_PX = 40.0
"""The ground is drawn as a plane whose lines meet this far above the horizon, px: as if a low rise hid
the farthest ground, whose features would be thinner than a pixel."""

LOOKS = 4, 16
"""Heights within a pixel at which it is asked for what lies there, at least and at most: the far ground is seen so
flat that a road across is thinner than a pixel. Between them, places a pixel's width apart on it are enough."""

STRIP = 32
"""Rows that have as many looks as the farthest of them, and stay in the processor's cache."""

TURNED = math.atan(((math.sqrt(5) - 1) / 2) ** 3)
"""How far the map of roads and water is turned, rad: a little, and by a power of the golden ratio, so that its
repetitions do not lie behind one another."""


def laid(texture: Floats, sheet: Sheet, below: Floats, finer: float, ifov_rad: float) -> Floats:
    """(rows, cols): a periodic texture laid on the ground; at the horizon one texel is 1 / `finer` px wide.

    below: (rows, cols) px below the horizon. Near ground shows texels as long as wide, seen slantwise; ground so far
    that a texel would be less than a row high shows one in each row, or what is fine would flicker.
    """
    under = below + VANISHING_PX
    side, steep = texture.shape[0], VANISHING_PX * finer / ifov_rad
    far = math.sqrt(steep)  # where a texel is a row high, px
    along = np.where(under < far, under, 2 * far - steep / np.maximum(under, far))
    x, y = (np.mod(at, side).astype(np.float32) for at in (sheet.columns * VANISHING_PX * finer / under, along))
    return np.asarray(cv2.remap(closed(texture), x, y, cv2.INTER_LINEAR))


def covered(inside: Floats, sheet: Sheet, below: Floats, ifov_rad: float) -> Floats:
    """(rows, cols) 0..1: what something on the ground covers of each pixel, `below` px below the horizon.

    inside: (side, side) texels inside of its edge, on a periodic map of ground as long as wide. Ground is
    seen VANISHING_PX * ifov below the level at least, where a texel is a px wide, and lower by that angle.
    """
    wide, side = closed(inside), inside.shape[0]
    cosine, sine = math.cos(TURNED) / side, math.sin(TURNED) / side
    # Where the farthest ground shows the map, in sides of it.
    x, y = cosine * sheet.columns - sine / ifov_rad, sine * sheet.columns + cosine / ifov_rad
    farthest = x.astype(np.float32), y.astype(np.float32)
    strips = [below[row : row + STRIP] / VANISHING_PX + 1 for row in range(0, len(below), STRIP)]
    return np.concatenate([_looked_at(wide, farthest, strip.astype(np.float32), ifov_rad) for strip in strips])


def _looked_at(wide: Floats, farthest: tuple[Floats, Floats], px_per_texel: Floats, ifov_rad: float) -> Floats:
    """What is covered of a few rows, (rows, cols) float32; px_per_texel (rows, cols): how wide a texel is there."""
    side = wide.shape[0] - 1
    high = 1 / (ifov_rad * VANISHING_PX * float(px_per_texel.min()))  # a px on the ground, in what it is wide
    looks = min(max(math.ceil(high), LOOKS[0]), LOOKS[1])
    total = np.zeros_like(px_per_texel)
    for shift in (np.arange(looks) + 0.5) / looks - 0.5:
        near = px_per_texel + np.float32(shift / VANISHING_PX)
        x, y = (at / near for at in farthest)
        for at in (x, y):
            at -= np.floor(at)
            at *= side
        edge: Floats = np.asarray(cv2.remap(wide, x, y, cv2.INTER_LINEAR), np.float32)
        edge *= near
        edge += np.float32(0.5)
        total += np.clip(edge, 0, 1, out=edge)
    return total / np.float32(looks)


def closed(texture: Floats) -> Floats:
    """A periodic texture, and its first row and column once more past its last."""
    return np.asarray(cv2.copyMakeBorder(texture, 0, 1, 0, 1, cv2.BORDER_WRAP))
