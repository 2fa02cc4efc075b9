"""What is looked at of many frames, or of large ones."""

from __future__ import annotations

import math

import numpy as np

from irsim.measure.given import Values
from irsim.types import Indices

LARGE = 1280 * 1024
"""Pixels of a picture beyond which what needs no more of them is read off a part, by a fixed rule."""


def coarseness(shape: tuple[int, ...]) -> int:
    """Each so many-th row and column of a picture (rows, columns) leave no more pixels than `LARGE`; 1 where it has no
    more."""
    return math.ceil(math.sqrt(math.prod(shape) / LARGE))


def evenly(count: int, most: int) -> Indices:
    """Up to `most` of `count` places, 0 to count - 1, evenly over all, the first and the last among them."""
    found: Indices = np.unique(np.linspace(0, count - 1, most).astype(np.intp))
    return found


def middle(frames: Values, widest: int) -> Values:
    """Of frames (T, rows, columns) the middle, no more than `widest` px either way."""
    rows, columns = (slice(max(side - widest, 0) // 2, None) for side in frames.shape[1:])
    return frames[:, rows, columns][:, :widest, :widest]
