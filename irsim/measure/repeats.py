"""Frames that show what the one before showed, bit for bit, and hold nothing new; and frames that were lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.errors import InputError
from irsim.measure.given import Values
from irsim.measure.noise_3d import LEAST_NOISE_FRAMES
from irsim.types import Bools, Floats, Indices

_LEAST_CHANGED = 30
"""Pixels that change from one new frame to the next, in the median: two frames are then alike by chance, where that
many change in a mean frame, in e^-30 of all."""
_NOISY = 0.3
"""Share of the pixels that change from one new frame to the next, at least, where there is noise of 0.4 counts or more:
rounded, two of its values are equal in 0.64 of all cases at most."""
_OFF_BEAT = 0.25
"""Share of a period by which times may be off whole ones: those of frames that were stamped as they came are off by
any."""
_TOLD = 2.0**48
"""Periods from one time to the next, at most, that float64 tells by a small share of one; and all of them fit int64."""
_LEAST_NEXT = 0.25
"""Share of the frames that follow the one before: where fewer do, times are those of something else than the camera."""
_MOST_LOST = 4
_LEAST_LOST = 3000
"""Times as many frames as there are may be lost, or so many if that is more, before a recording is cut: of what lies
farther apart no memory of the noise tells, and to count the frames between takes long."""


@dataclass(frozen=True, eq=False)
class NewFrames:
    """Frames of a recording that are not repeats.

    index       (N,) where they lie in the recording
    number      (N,) when they were taken, in frames of the camera, from 0 on
    rate_hz     of the camera: below the recording's where that shows most frames more than once
    slower      how many times below
    lost        frames that are missing between the first and the last one
    pauses      of `index` those before which too many are missing for what is to be told of time
    """

    index: Indices
    number: Indices
    rate_hz: float
    slower: float
    lost: int
    pauses: tuple[int, ...]


def new_frames(frames: Values, rate_hz: float, times: Floats | None = None) -> NewFrames:
    """Of frames (T, rows, columns), recorded at `rate_hz`.

    Pixels do not tell whether time went on while a picture was repeated. A lone repeat is taken for a frame
    that arrived twice, for which none passes, whatever its own time says; two and more in a row for a picture that
    stood still, as for a correction's shutter, while time went on. Where most frames are repeated, a slower camera was
    recorded at a higher rate. Of repeats whose `times` are those of the frames that they repeat none passes, however
    many they are.

    Nor do they tell of lost frames: that `times` (T,), s, do where all frames are whole periods apart. Where these are
    multiples of two periods or more, the camera is that much slower.

    Frames alike by chance are no repeats: where noise is far below one count, all count, and so they do in a still
    picture of which a part changes once or twice. InputError where fewer than four are new.
    """
    count = len(frames)
    gaps, beat, at_once = _gaps(count, rate_hz, times)
    slower = float(beat)
    lost = int(gaps.sum())
    missing = np.cumsum(gaps)
    changed = np.array([int(np.count_nonzero(frames[k] != frames[k - 1])) for k in range(1, count)], np.intp)
    index = np.concatenate([[0], np.flatnonzero(changed) + 1]).astype(np.intp)
    usually = float(np.median(changed[changed > 0])) if changed.any() else 0.0
    few = len(index) < LEAST_NOISE_FRAMES
    if few and usually > _NOISY * frames[0].size:
        raise InputError(
            f"{len(index)} of {count} frames are new, the others repeat the one before bit for bit: too few to measure "
            f"noise; allowed: at least {LEAST_NOISE_FRAMES}"
        )
    if few or usually < _LEAST_CHANGED or len(index) == count:
        every = np.arange(count)
        return _cut(every, every + missing, rate_hz, slower, lost)
    shown = np.maximum(np.add.reduceat(~at_once, index, dtype=np.intp), 1)  # how often each came, in time
    gone = np.diff(missing[index], append=missing[-1])  # after each, until the next one
    usual = float(np.median(shown))
    if usual < 2:
        passed = np.where(shown == 2, 1, shown) + gone
    else:
        usual = float(shown[shown < 2 * usual].mean())
        passed = np.maximum(np.rint((shown + gone) / usual), 1).astype(np.intp)
        slower *= usual
        lost = round(lost / usual)
    return _cut(index, np.cumsum(passed) - passed, rate_hz, slower, lost)


def _gaps(count: int, rate_hz: float, times: Floats | None) -> tuple[Indices, int, Bools]:
    """(T,) recorded frames that are missing before each of `count`, how many periods of the rate one takes, and (T,)
    which have the time of the one before; none where times do not tell."""
    nothing: tuple[Indices, int, Bools] = np.zeros(count, np.intp), 1, np.zeros(count, np.bool_)
    if times is None or count < 2:
        return nothing
    periods = np.diff(times.astype(np.float64)) * rate_hz  # differences of whole numbers may wrap
    whole = np.rint(periods)
    if not ((np.abs(periods - whole) <= _OFF_BEAT) & (whole < _TOLD)).all():
        return nothing
    slower = max(int(np.gcd.reduce(whole.astype(np.intp))), 1)
    gaps = np.concatenate([[0], np.maximum(whole // slower - 1, 0)]).astype(np.intp)
    if np.count_nonzero(gaps[1:] == 0) < _LEAST_NEXT * count:
        return nothing
    return gaps, slower, np.concatenate([[False], whole == 0])


def _cut(index: Indices, number: Indices, rate_hz: float, slower: float, lost: int) -> NewFrames:
    return NewFrames(index, number, rate_hz / slower, slower, lost, tuple(sorted(index[_pauses(number)].tolist())))


def _pauses(number: Indices) -> list[int]:
    """Of frames taken at `number` (T,) those before which to cut: pieces of which more are lost than may be are cut at
    their longest pause."""
    found, pieces = [], [(0, len(number))]
    while pieces:
        first, last = pieces.pop()
        lost = number[last - 1] - number[first] + 1 - (last - first)
        if lost > max(_MOST_LOST * (last - first), _LEAST_LOST):
            place = first + 1 + int(np.argmax(np.diff(number[first:last])))
            found.append(place)
            pieces += [(first, place), (place, last)]
    return found
