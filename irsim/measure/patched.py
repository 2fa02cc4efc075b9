"""Frames in which good pixels stand for the bad ones."""

from __future__ import annotations

import math

import numpy as np

from irsim.measure.defects import whole_counts
from irsim.measure.given import Values
from irsim.measure.picked import LARGE
from irsim.types import Bools, Floats, Indices

_REACH = 16
"""Pixels on either side along two lines by which these are told apart: the median of 33 differences adds a tenth of the
fixed pattern's variance to the patched pixels alone, and an edge farther off is not looked at."""
_LEAST = 5
"""Pairs of good pixels, at least, that tell by how much two lines differ."""
_AT_ONCE = 50_000
"""Bad pixels that are worked out together."""


def patched(frames: Values, bad: Bools) -> Values:
    """Frames (T, rows, columns) with each bad pixel's values those of the nearest good one, and what its own row and
    column lie above that one's in the mean: else a camera's columns would be pixels' fixed pattern where it is patched.
    Whole counts stay whole.

    To be read only, for they are the frames given, not a copy, where no pixel is bad (or all are).
    """
    if not bad.any() or bad.all():
        return frames
    from scipy.ndimage import distance_transform_edt

    rows, columns = distance_transform_edt(bad, return_distances=False, return_indices=True)
    good = np.stack([rows[bad], columns[bad]])
    above = _lines_above(frames.mean(axis=0, dtype=np.float64), bad, good)
    if whole_counts(frames):
        above = np.rint(above)
    values = frames[:, good[0], good[1]] + above
    if np.issubdtype(frames.dtype, np.integer):
        ends = np.iinfo(frames.dtype.name)
        values = values.clip(ends.min, ends.max)
    # In few pixels a picture's values lie side by side in time, in which order sums are rounded.
    whole = frames[:, rows, columns] if bad.size <= LARGE else frames.copy()
    whole[:, bad] = values
    return whole


def _lines_above(level: Floats, bad: Bools, good: Indices) -> Floats:
    """What row and column of each bad pixel of a picture (rows, columns) lie above those of its good one, whose places
    are (2, bad pixels): (bad pixels,)."""
    known = np.pad(np.where(bad, math.nan, level), _REACH, constant_values=math.nan)
    at = np.argwhere(bad).T
    above = np.zeros(at.shape[1])
    for picture, axis in ((known, 0), (known.T, 1)):
        apart = np.flatnonzero(at[axis] != good[axis])
        for first in range(0, len(apart), _AT_ONCE):
            some = apart[first : first + _AT_ONCE]
            above[some] += _line_above(picture, at[axis, some], good[axis, some], at[1 - axis, some])
    return above


def _line_above(known: Floats, line: Indices, other: Indices, place: Indices) -> Floats:
    """What rows lie above others near some columns of a picture that has `_REACH` px of NaN around it: the medians of
    where both are known, 0 where that is almost nowhere."""
    near = place[:, None] + np.arange(2 * _REACH + 1)
    apart = known[line[:, None] + _REACH, near] - known[other[:, None] + _REACH, near]
    few = np.isfinite(apart).sum(axis=1) < _LEAST
    apart[few] = 0
    return np.asarray(np.nanmedian(apart, axis=1))
