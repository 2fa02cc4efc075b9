"""The frames of a recording that noise is read from: the longest stretch in which time, scene and pattern go on."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from irsim.errors import InputError, counted
from irsim.measure.given import Values
from irsim.measure.noise_3d import LEAST_NOISE_FRAMES
from irsim.measure.repeats import NewFrames

_NAMED = 4
"""Frames before which there is a break of one kind that are named; of more, how many there are."""


@dataclass(frozen=True)
class Breaks:
    """Frames before which a recording is cut.

    pauses  more time goes by before these than memory can be told over
    jumps   the picture of these is another than that of the frame before
    steps   the fixed pattern is another from these on
    """

    pauses: tuple[int, ...] = ()
    jumps: tuple[int, ...] = ()
    steps: tuple[int, ...] = ()

    @property
    def all(self) -> list[int]:
        return sorted({*self.pauses, *self.jumps, *self.steps})

    def causes(self, start: int) -> Iterator[str]:
        """What is there, for people; `start` is the number of the first recorded frame."""
        if self.pauses:
            yield f"more time goes by before {_frames(self.pauses, start)} than noise remembers"
        if self.jumps:
            yield f"the picture becomes another at {_frames(self.jumps, start)}"
        if self.steps:
            yield f"the fixed pattern changes at {_frames(self.steps, start)}"


@dataclass(frozen=True)
class Stretch:
    """Frames that figures are read from, and what was left out.

    recorded    frames of the recording
    repeats     those among them that show the one before bit for bit
    lost        frames of the camera that are missing among them, as their times tell
    breaks      where it was cut
    index       frames that are used, none of them a repeat
    number      when these were taken, in frames of the camera from the first new one on
    rate_hz     of the camera; see `irsim.measure.repeats`
    slower      frame periods of the recording that one of the camera takes
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
        """Frames of the camera from the first that is used to the last."""
        return self.number[-1] - self.number[0] + 1

    def of(self, frames: Values) -> Values:
        """The frames (T, rows, columns) that are used; a view where they follow each other."""
        first, last = self.index[0], self.index[-1]
        if last - first + 1 == len(self.index):
            return frames[first : last + 1]
        return frames[list(self.index)]

    def left_out(self, start: int) -> Iterator[str]:
        """Sentences for people; `start` is the number of the first recorded frame."""
        if self.repeats:
            repeat, they_do = ("repeats", "it does") if self.repeats == 1 else ("repeat", "they do")
            yield f"{self.repeats} of {self.recorded} frames {repeat} the one before bit for bit: {they_do} not count"
        if self.lost:
            yield f"{self.lost} {'frame is' if self.lost == 1 else 'frames are'} missing, by the times of the others"
        if self.slower > 1:
            yield f"the camera is taken to have {self.rate_hz:.3g} Hz, in whose frames rho and lags are"
        if causes := "; ".join(self.breaks.causes(start)):
            first, last = start + self.index[0], start + self.index[-1]
            yield f"{causes}: figures are those of frames {first} to {last}, the longest stretch without such a break"


def longest_stretch(new: NewFrames, breaks: Breaks, recorded: int, start: int) -> Stretch:
    """The most of the new frames of so many `recorded` ones, from number `start` on, between breaks.

    The first of equals. InputError where these are too few to measure noise.
    """
    ends = [0, *np.searchsorted(new.index, breaks.all), len(new.index)]
    first, last = max(itertools.pairwise(ends), key=lambda pair: pair[1] - pair[0])
    if last - first < LEAST_NOISE_FRAMES <= len(new.index):
        raise InputError(
            f"{'; '.join(breaks.causes(start))}: the longest stretch without such a break has "
            f"{counted(last - first, 'frame')}, too few to measure noise; allowed: at least {LEAST_NOISE_FRAMES}"
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
    """'frame 3', or 'frames 3, 9, 12, 20 and 7 more'."""
    named = [str(start + frame) for frame in frames[:_NAMED]]
    more = f" and {len(frames) - _NAMED} more" if len(frames) > _NAMED else ""
    return f"frame{'s' if len(frames) > 1 else ''} {', '.join(named)}{more}"
