"""Frames that show what the one before showed, bit for bit, and hold nothing new; and frames that were lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.measure.region import Values
from irsim.types import Bools, Floats

Indices = npt.NDArray[np.intp]

_LEAST_NEW = 4
"""Frames that must be left: fewer are no recording of noise, but one of a picture without any."""
_LEAST_CHANGED = 30
"""Pixels that change from one new frame to the next, in the median: two frames are then alike by chance, where that
many change in a mean frame, in e^-30 of all."""
_OFF_BEAT = 0.25
"""Share of a period by which times may be off whole ones: those of frames that were stamped as they came are off by
any."""
_LEAST_NEXT = 0.25
"""Share of the frames that follow the one before: where fewer do, times are those of something else than the camera."""
_MOST_LOST = 4
"""Times as many frames as there are may be lost; of more no memory of the noise tells, and to count them takes long."""


@dataclass(frozen=True, eq=False)
class NewFrames:
    """Frames of a recording that are not repeats.

    index       (N,) where they lie in the recording
    number      (N,) when they were taken, in frames of the camera, from 0 on
    rate_hz     of the camera: below the recording's where that shows most frames more than once
    lost        frames that are missing between the first and the last one
    """

    index: Indices
    number: Indices
    rate_hz: float
    lost: int


def new_frames(frames: Values, rate_hz: float, times: Floats | None = None) -> NewFrames:
    """Of frames (T, rows, columns), recorded at `rate_hz`.

    Pixels do not tell whether time went on while a picture was repeated. A lone repeat is taken for a frame
    that arrived twice, for which none passes, whatever its own time says; two and more in a row for a picture that
    stood still, as for a correction's shutter, while time went on. Where most frames are repeated, a slower camera was
    recorded at a higher rate. Of repeats whose `times` are those of the frames that they repeat none passes, however
    many they are.

    Nor do they tell of lost frames: that `times` (T,), s, do where all frames are whole periods apart. Where these are
    multiples of two periods or more, the camera is that much slower.

    Frames alike by chance are no repeats: where noise is far below one count, all count.
    """
    count = len(frames)
    gaps, slower, at_once = _gaps(count, rate_hz, times)
    rate_hz /= slower
    lost = int(gaps.sum())
    missing = _counted(gaps)
    changed = np.array([int(np.count_nonzero(frames[k] != frames[k - 1])) for k in range(1, count)], np.intp)
    index = np.concatenate([[0], np.flatnonzero(changed) + 1]).astype(np.intp)
    few = len(index) < _LEAST_NEW or float(np.median(changed[changed > 0])) < _LEAST_CHANGED
    if few or len(index) == count:
        every = np.arange(count)
        return NewFrames(every, every + np.cumsum(missing), rate_hz, lost)
    shown = np.maximum(np.add.reduceat(~at_once, index, dtype=np.intp), 1)  # how often each came, in time
    before = np.cumsum(missing)[index]
    gone = np.diff(before, append=missing.sum())  # after each, until the next one
    usual = float(np.median(shown))
    if usual < 2:
        passed = np.where(shown == 2, 1, shown) + gone
    else:
        usual = float(shown[shown < 2 * usual].mean())
        passed = np.maximum(np.rint((shown + gone) / usual), 1).astype(np.intp)
        rate_hz /= usual
        lost = round(lost / usual)
    return NewFrames(index, np.cumsum(passed) - passed, rate_hz, lost)


def _gaps(count: int, rate_hz: float, times: Floats | None) -> tuple[Indices, int, Bools]:
    """(T,) recorded frames that are missing before each of `count`, how many periods of the rate one takes, and (T,)
    which have the time of the one before; none where times do not tell."""
    nothing: tuple[Indices, int, Bools] = np.zeros(count, np.intp), 1, np.zeros(count, np.bool_)
    if times is None or count < 2:
        return nothing
    periods = np.diff(times) * rate_hz
    whole = np.rint(periods)
    if (np.abs(periods - whole) > _OFF_BEAT).any():
        return nothing
    slower = max(int(np.gcd.reduce(whole.astype(np.intp))), 1)
    gaps = np.concatenate([[0], np.maximum(whole // slower - 1, 0)]).astype(np.intp)
    if np.count_nonzero(gaps[1:] == 0) < _LEAST_NEXT * count:
        return nothing
    return gaps, slower, np.concatenate([[False], whole == 0])


def _counted(gaps: Indices) -> Indices:
    """(T,) gaps as time that went on: all together no more than _MOST_LOST times the frames."""
    most = _MOST_LOST * len(gaps)
    return gaps if gaps.sum() <= most else gaps.clip(max=most // np.count_nonzero(gaps))
