"""How smoke billows: lumps at several scales that roll, push its edge in and out, and are warmer and colder.

Numbers without a source were chosen by eye.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from irsim.geometry.random_fields import power_law
from irsim.types import Floats

SIDE = 256
"""Of the periodic fields that lumps are cut from, texels."""
ACROSS = 40.0
"""Texels of them to half the lesser side of the smoke, which is the size of its largest lumps, too."""
SLOPE = 11 / 3
"""Slope of the spectrum of what is looked through, of a scalar that turbulence mixes: as in space (Obukhov 1949)."""
ROUND = 5.5
"""The same of what pushes the edge: steeper, so that lumps are round."""
ROLLING = 0.35
"""Two fields pass through each other, each to the right or left by so many halves of the lesser side in a second, and
by six tenths of that up or down."""
PUSHED = 0.32
"""How far lumps push the edge, in halves of its size: about the standard deviation."""
MOST = 1.5
"""No lump pushes it by more than so many times that."""
WHOLE = 0.9
"""Within such a share of its dense part lumps push nothing: it hides as much as without."""
FULL = 1.4
"""From here on they push as far as they can."""
THICKER = 0.5
"""Logarithm of the optical depth, outside of the dense part: about its standard deviation."""

OUTERMOST = PUSHED * MOST
"""How much farther out a smoke that billows is drawn, in halves of its size."""


def lumps(x: Floats, y: Floats, time: float, seed: int, name: str) -> Floats:
    """(rows, cols, 3) of mean 0 and variance 1 each: how far the edge is pushed, how thick and how warm the smoke is.

    x (cols,), y (rows,): places from its middle, in halves of its lesser side;  time  s
    """
    field = _fields(seed, name)
    total = np.zeros((len(y), len(x), 3), np.float32)
    for way, begin in ((1.0, 0.0), (-1.0, SIDE / 2)):
        rolled = way * ROLLING * time
        columns, rows = (
            np.mod(part * ACROSS + begin, SIDE).astype(np.float32)
            for part in np.broadcast_arrays(x + rolled, y[:, None] + 0.6 * rolled)
        )
        total += cv2.remap(field, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(total / np.sqrt(2))


def torn(u: Floats, v: Floats, pushed: Floats, billows: float) -> tuple[Floats, Floats]:
    """(rows, cols) each: the places of even smoke that smoke shows at u (cols,), v (rows,), in halves of its size."""
    radius = np.hypot(u, v[:, None])
    share = np.clip((radius - WHOLE) / (FULL - WHOLE), 0, 1)
    out = billows * PUSHED * MOST * np.tanh(pushed / MOST) * share
    times = 1 - out / np.maximum(radius, WHOLE)
    return u * times, v[:, None] * times


def thickened(u: Floats, v: Floats, thick: Floats, billows: float) -> Floats:
    """(rows, cols): by what billows multiply the optical depth; by 1 at least within the dense part."""
    outside = np.clip((np.hypot(u, v[:, None]) - 1) / (FULL - 1), 0, 1)
    return np.exp(billows * THICKER * (np.maximum(thick, 0) + outside * np.minimum(thick, 0)))


@lru_cache(maxsize=8)
def _fields(seed: int, name: str) -> Floats:
    """(SIDE, SIDE, 3) periodic fields of mean 0 and variance 1."""
    slopes = {"pushed": ROUND, "thick": SLOPE, "warm": SLOPE}
    parts = (power_law((SIDE, SIDE), slope, ACROSS, 1.0, seed, name, what) for what, slope in slopes.items())
    return np.stack(list(parts), axis=-1)
