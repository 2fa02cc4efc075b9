"""Selection of the frames on which noise is measured: the longest stretch without a break, less repeated frames.

Breaks are pauses, changes of the whole picture (shutter, splash screen, cut) and changes of the fixed pattern (by a
correction).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.calibration.motion import neighbour_covariance
from irsim.calibration.statistics import LEAST_FRAMES, Values, center_lines
from irsim.errors import InputError, counted
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats, Indices

_CELL = 8
_BEYOND = 12.0
"""Ratio of a change to the median change beyond which the picture jumps. Three real sensors have up to 8.6."""
_SURE = 10.0
"""Number of changes whose median is reliable. For m changes, `_BEYOND` is multiplied by 1 + (10 / m)^2."""
_FEW = 0.2
"""Largest fraction of changes that may count as jumps. If more exceed the limit, they are taken as motion of the
scene."""
_STEP_FRAMES = (4, 8, 16)
"""Numbers of frames that are averaged before and after a possible step of the fixed pattern."""
_STEP_ERRORS = 6.0
_STEP_RATIO = 1.3
"""Least ratio of the squared change at a step to that before and after the step."""
_STEP_BLUR = 0.25
"""Largest neighbour correlation of the change at a step. Optics blur light over neighbours, but no fixed pattern."""
_MOST_LOST = 3000
_NAMED = 4


@dataclass(frozen=True)
class Breaks:
    """Indices of frames that follow a pause, a jump of the picture or a step of the fixed pattern."""

    pauses: tuple[int, ...] = ()
    jumps: tuple[int, ...] = ()
    steps: tuple[int, ...] = ()

    @property
    def all(self) -> list[int]:
        return sorted({*self.pauses, *self.jumps, *self.steps})

    def sentences(self, start: int) -> Iterator[str]:
        """Yield a sentence for each kind of break, in which frames are numbered from `start`."""
        if self.pauses:
            yield f"time passes without frames before {_frames(self.pauses, start)}"
        if self.jumps:
            yield f"the whole picture changes at {_frames(self.jumps, start)}"
        if self.steps:
            yield f"the fixed pattern changes at {_frames(self.steps, start)}"


@dataclass(frozen=True)
class Stretch:
    """Measured frames of a recording.

    recorded    number of frames of the recording
    repeats     number of frames that repeat the one before
    lost        number of the camera's frames that are missing, as inferred from the frame times
    breaks      breaks in the recording
    index       indices of the measured frames in the recording
    number      frame numbers of the measured frames in the camera
    rate_hz     frame rate of the camera, Hz
    slower      frame periods of the recording in one frame period of the camera
    """

    recorded: int
    repeats: int
    lost: int
    breaks: Breaks
    index: tuple[int, ...]
    number: tuple[int, ...]
    rate_hz: float
    slower: float

    @property
    def length(self) -> int:
        """Number of the camera's frames from the first measured one to the last."""
        return self.number[-1] - self.number[0] + 1

    def of(self, frames: Values) -> Values:
        """Return the measured frames, as a view where they are consecutive."""
        first, last = self.index[0], self.index[-1]
        return frames[first : last + 1] if last - first + 1 == len(self.index) else frames[list(self.index)]

    def left_out(self, start: int) -> Iterator[str]:
        """Yield sentences on frames that are left out, in which frames are numbered from `start`."""
        if self.repeats:
            verb = "repeats" if self.repeats == 1 else "repeat"
            yield f"{self.repeats} of {self.recorded} frames {verb} the one before bit for bit and are not measured"
        if self.lost:
            yield f"{counted(self.lost, 'frame')} missing, by the times of the others"
        if self.slower > 1:
            yield f"the camera's rate is taken as {self.rate_hz:.3g} Hz; rho and lags are in its frames"
        if causes := "; ".join(self.breaks.sentences(start)):
            first, last = start + self.index[0], start + self.index[-1]
            yield f"{causes}: frames {first} to {last} are measured, the longest stretch without a break"


@dataclass(frozen=True, eq=False)
class NewFrames:
    """Frames that do not repeat the one before: (N,) `index` and `number`. All fields are as in `Stretch`."""

    index: Indices
    number: Indices
    rate_hz: float
    slower: float
    lost: int
    pauses: tuple[int, ...]


def new_frames(frames: Values, rate_hz: float, times: Floats | None = None) -> NewFrames:
    """Return the frames that do not repeat the one before, and their frame numbers in the camera.

    A single repeat is a frame that arrived twice, and no time passes. Two or more in a row are a frozen picture, during
    which time passes unless `times` (T,), s, show otherwise. Where most frames are repeats, the camera is slower than
    the recording. Gaps of whole frame periods between `times` are lost frames.
    """
    count = len(frames)
    gaps, beat, same_time = _lost_frames(count, rate_hz, times)
    missing = np.cumsum(gaps)
    changed = np.array([int(np.count_nonzero(frames[k] != frames[k - 1])) for k in range(1, count)], np.intp)
    index = np.concatenate([[0], np.flatnonzero(changed) + 1]).astype(np.intp)
    usually = float(np.median(changed[changed > 0])) if changed.any() else 0.0
    few = len(index) < LEAST_FRAMES
    if few and usually > 0.3 * frames[0].size:
        raise InputError(
            f"{len(index)} of {count} frames are new, the others repeat the one before bit for bit: too few to measure "
            f"noise; allowed: at least {LEAST_FRAMES}"
        )
    slower, lost = float(beat), int(gaps.sum())
    if few or usually < 30 or len(index) == count:  # frames may be equal by chance where noise is far below a count
        return _with_pauses(np.arange(count), np.arange(count) + missing, rate_hz, slower, lost)
    shown = np.maximum(np.add.reduceat(~same_time, index, dtype=np.intp), 1)
    gone = np.diff(missing[index], append=missing[-1])
    usual = float(np.median(shown))
    if usual < 2:
        passed = np.where(shown == 2, 1, shown) + gone
    else:
        usual = float(shown[shown < 2 * usual].mean())
        passed = np.maximum(np.rint((shown + gone) / usual), 1).astype(np.intp)
        slower, lost = slower * usual, round(lost / usual)
    return _with_pauses(index, np.cumsum(passed) - passed, rate_hz, slower, lost)


def _lost_frames(count: int, rate_hz: float, times: Floats | None) -> tuple[Indices, int, Bools]:
    """Return the number of frames lost before each frame, (T,); the camera's frame period in units of the nominal
    period 1 / `rate_hz`; and the mask (T,) of frames whose time equals that of the frame before."""
    nothing = np.zeros(count, np.intp), 1, np.zeros(count, np.bool_)
    if times is None or count < 2:
        return nothing
    periods = np.diff(times.astype(np.float64)) * rate_hz
    whole = np.rint(periods)
    if not ((np.abs(periods - whole) <= 0.25) & (whole < 2.0**48)).all():
        return nothing
    beat = max(int(np.gcd.reduce(whole.astype(np.intp))), 1)
    gaps = np.concatenate([[0], np.maximum(whole // beat - 1, 0)]).astype(np.intp)
    if np.count_nonzero(gaps[1:] == 0) < count / 4:
        return nothing
    return gaps, beat, np.concatenate([[False], whole == 0])


def _with_pauses(index: Indices, number: Indices, rate_hz: float, slower: float, lost: int) -> NewFrames:
    pauses = np.flatnonzero(np.diff(number) > max(_MOST_LOST, 4 * len(number))) + 1
    return NewFrames(index, number, rate_hz / slower, slower, lost, tuple(index[pauses].tolist()))


def jumps(frames: Sequence[Values]) -> list[int]:
    """Return the indices of frames at which the whole picture jumps.

    The change from the frame before is the median, over cells of 8 x 8 px, of the absolute difference of their means. A
    jump exceeds 12 times the median change over time. If more than a fifth of all changes do, none is a jump.
    """
    if len(frames) < 2:
        return []
    rows, columns = (max(side // _CELL, 1) for side in frames[0].shape)
    cells = [cv2.resize(f.astype(np.float64), (columns, rows), interpolation=cv2.INTER_AREA) for f in frames]
    changes = np.array([np.median(np.abs(later - before)) for before, later in itertools.pairwise(cells)])
    found = np.flatnonzero(changes > _BEYOND * (1 + (_SURE / len(changes)) ** 2) * np.median(changes)) + 1
    return found.tolist() if len(found) <= max(2, _FEW * len(changes)) else []


def pattern_steps(flat: Floats) -> list[int]:
    """Return the frames of a flat window (T, rows, columns) at which the fixed pattern changes.

    The mean of m frames is compared with the mean of the m frames before, without offsets of rows and columns. Without
    a step the mean squared difference over n pixels is 2 sigma^2 / m with a relative error of sqrt(2 / n). At a step it
    far exceeds the differences 2 m frames earlier and later, and is uncorrelated between neighbouring pixels. Drift and
    correlated noise raise all differences alike. Weak steps, and steps of rows and columns alone, are not found.
    """
    sums = np.concatenate([np.zeros((1, *flat.shape[1:])), np.cumsum(center_lines(flat - flat[0]), axis=0)])
    found: list[int] = []
    for width in _STEP_FRAMES:
        places = range(width, len(flat) - width + 1)
        if len(places) < 2 * width:
            continue
        after = [(sums[k + width] - 2 * sums[k] + sums[k - width]) / width for k in places]
        logs = np.log([max(float(np.square(each).mean()), 1e-300) for each in after])
        error = max(2 / np.sqrt(flat[0].size), MEDIAN_TO_SIGMA * float(np.median(np.abs(logs[width:] - logs[:-width]))))
        for place in np.argsort(-logs):
            others = [logs[at] for at in (place - 2 * width, place + 2 * width) if 0 <= at < len(logs)]
            far = not others or logs[place] - max(others) > max(_STEP_ERRORS * error, np.log(_STEP_RATIO))
            near = any(abs(int(place) + width - other) < 2 * width for other in found)
            change = after[int(place)]
            sharp = neighbour_covariance(change) < _STEP_BLUR * float(np.square(change).mean())
            if not near and others and far and sharp:
                found.append(int(place) + width)
            elif not near:
                break
    return sorted(found)


def longest_stretch(new: NewFrames, breaks: Breaks, recorded: int, start: int) -> Stretch:
    """Return the longest stretch between breaks. Raises InputError where it is too short to measure noise."""
    ends = [0, *np.searchsorted(new.index, breaks.all), len(new.index)]
    first, last = max(itertools.pairwise(ends), key=lambda pair: pair[1] - pair[0])
    if last - first < LEAST_FRAMES <= len(new.index):
        raise InputError(
            f"{'; '.join(breaks.sentences(start))}: the longest stretch without a break has "
            f"{counted(last - first, 'frame')}, too few to measure noise; allowed: at least {LEAST_FRAMES}"
        )
    return Stretch(
        recorded=recorded,
        repeats=recorded - len(new.index),
        lost=new.lost,
        breaks=breaks,
        index=tuple(new.index[first:last].tolist()),
        number=tuple(new.number[first:last].tolist()),
        rate_hz=new.rate_hz,
        slower=new.slower,
    )


def _frames(frames: tuple[int, ...], start: int) -> str:
    """Return frame numbers as text: 'frame 3', or 'frames 3, 9, 12, 20 and 7 more'."""
    named = [str(start + frame) for frame in frames[:_NAMED]]
    more = f" and {len(frames) - _NAMED} more" if len(frames) > _NAMED else ""
    return f"frame{'s' if len(frames) > 1 else ''} {', '.join(named)}{more}"
