"""Frames that show what the one before showed, bit for bit: they hold nothing new."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.measure.region import Values

Indices = npt.NDArray[np.intp]

_LEAST_NEW = 4
"""Frames that must be left: fewer are no recording of noise, but one of a picture without any."""
_LEAST_CHANGED = 30
"""Pixels that change from one new frame to the next, in the median: two frames are then alike by chance, where that
many change in a mean frame, in e^-30 of all."""


@dataclass(frozen=True, eq=False)
class NewFrames:
    """Frames of a recording that are not repeats.

    index       (N,) where they lie in the recording
    number      (N,) when they were taken, in frames of the camera, from 0 on
    rate_hz     of the camera: below the recording's where that shows most frames more than once
    """

    index: Indices
    number: Indices
    rate_hz: float


def new_frames(frames: Values, rate_hz: float) -> NewFrames:
    """Of frames (T, rows, columns), recorded at `rate_hz`.

    Pixels do not tell whether time went on while a picture was repeated. A lone repeat is taken for a frame
    that arrived twice, for which none passes; two and more in a row for a picture that stood still, as for a
    correction's shutter, while time went on. Where most frames are repeated, a slower camera was recorded at a
    higher rate. Lost frames cannot be seen in them, and times are not asked for: those beside lost ones count as
    neighbours.

    Frames alike by chance are no repeats: where noise is far below one count, all count.
    """
    count = len(frames)
    changed = np.array([int(np.count_nonzero(frames[k] != frames[k - 1])) for k in range(1, count)], np.intp)
    index = np.concatenate([[0], np.flatnonzero(changed) + 1]).astype(np.intp)
    few = len(index) < _LEAST_NEW or float(np.median(changed[changed > 0])) < _LEAST_CHANGED
    if few or len(index) == count:
        every = np.arange(count)
        return NewFrames(every, every, rate_hz)
    shown = np.diff(index, append=count)  # how often each came
    usual = float(np.median(shown))
    if usual < 2:
        passed = np.where(shown == 2, 1, shown)
    else:
        usual = float(shown[shown < 2 * usual].mean())
        passed = np.maximum(np.rint(shown / usual), 1).astype(np.intp)
        rate_hz /= usual
    return NewFrames(index, np.cumsum(passed) - passed, rate_hz)
