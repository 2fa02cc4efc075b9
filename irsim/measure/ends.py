"""Where counts end: at 0 and at the highest there can be noise is cut off."""

from __future__ import annotations

import math

from irsim.measure.defects import whole_counts
from irsim.measure.given import Values
from irsim.types import Bools


def ends_of(frames: Values, top: float) -> tuple[float, float]:
    """Least and highest count that there can be in frames (T, rows, columns); values below 0 or between counts, as of
    another unit or freed of their mean, have no such ends, and may go to infinity."""
    return (0.0, top) if whole_counts(frames) and frames.min() >= 0 else (-math.inf, math.inf)


def at_an_end(values: Values, ends: tuple[float, float]) -> Bools:
    """Which values are at one of the ends, or beyond."""
    low, high = ends
    found: Bools = (values <= low) | (values >= high)
    return found
