"""What is looked at of many frames, or of large ones."""

from __future__ import annotations

import numpy as np

from irsim.measure.region import Values
from irsim.types import Indices


def evenly(count: int, most: int) -> Indices:
    """Up to `most` of `count` places, 0 to count - 1, evenly over all, the first and the last among them."""
    found: Indices = np.unique(np.linspace(0, count - 1, most).astype(np.intp))
    return found


def middle(frames: Values, widest: int) -> Values:
    """Of frames (T, rows, columns) the middle, no more than `widest` px either way."""
    rows, columns = (slice(max(side - widest, 0) // 2, None) for side in frames.shape[1:])
    return frames[:, rows, columns][:, :widest, :widest]
