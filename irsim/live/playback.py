"""Clock of a playback: the frame that is due, under play, pause, seek and speed."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace
from threading import Condition
from time import monotonic
from typing import Literal

import numpy as np

from irsim.recording import Recording
from irsim.types import Source

Status = Literal["playing", "paused", "ended"]

SETTLE_S = 0.1
"""Time from a viewer's subscription to the first frame, s, within which it subscribes to the other topics."""

SPEEDS = (0.01, 100.0)
"""Least and greatest speed, as a factor of real time."""


@dataclass(frozen=True, slots=True)
class State:
    """Status, index of the last frame shown (0 before the first one), and speed."""

    status: Status
    index: int
    speed: float


class Playback:
    """Position in `count` frames with times in s; several threads may use it.

    It is paused at frame 0 until `begin`. Frames come late where the caller is slow, and none is left out.
    """

    def __init__(self, count: int, time_of: Callable[[int], float], clock: Callable[[], float] = monotonic) -> None:
        self._count, self._time_of, self._clock = count, time_of, clock
        self._changed = Condition()
        self._next = 0
        self._due = math.inf
        self._again: float | None = None
        """Time at which frame `_next` is shown, playing or not; None: when it is due."""
        self._playing = self._stopped = self._begun = False
        self._speed = 1.0

    def begin(self) -> None:
        """Play from the first frame at the first call; show the last frame again at later calls."""
        with self._changed:
            if not self._begun:
                self._begun = self._playing = True
            if self._again is None:
                self._next = max(self._next - 1, 0)
            self._again = self._clock() + SETTLE_S
            self._changed.notify_all()

    def control(self, play: bool, speed: float, seek_s: float | None = None) -> State:
        """Play or pause at a speed, from the first frame at or after `seek_s` where it is given; return the state."""
        with self._changed:
            self._begun, self._playing = True, play
            if math.isfinite(speed) and speed > 0:
                self._speed = min(max(speed, SPEEDS[0]), SPEEDS[1])
            self._due = self._clock()
            if seek_s is not None:
                within = seek_s - 1e-9  # a time in whole ns may lie beside the frame's
                self._next = min(bisect_left(range(self._count), within, key=self._time_of), self._count - 1)
                self._again = self._due
            self._changed.notify_all()
            state = self._state()
            return state if seek_s is None else replace(state, status="playing" if play else "paused", index=self._next)

    def stop(self) -> None:
        """End `next` and all later calls of it."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()

    @property
    def state(self) -> State:
        with self._changed:
            return self._state()

    def next(self, timeout: float | None = None) -> int | None:
        """Wait for the frame that is due next and return its index; None after `stop`, or after `timeout` s."""
        end = math.inf if timeout is None else self._clock() + timeout
        with self._changed:
            while not self._stopped and (wait := self._wait()) > 0:
                wait = min(wait, end - self._clock())
                if wait <= 0:
                    return None
                self._changed.wait(None if math.isinf(wait) else wait)
            if self._stopped:
                return None
            now = self._clock()
            begun = self._due if self._again is None else now
            index, self._next, self._again = self._next, self._next + 1, None
            if self._next < self._count:
                step = (self._time_of(self._next) - self._time_of(index)) / self._speed
                self._due = max(begun + step, now)
            return index

    def _wait(self) -> float:
        """Return the time until a frame is due, s; infinite where none is."""
        if self._again is not None:
            return self._again - self._clock()
        if not self._playing or self._next >= self._count:
            return math.inf
        return self._due - self._clock()

    def _state(self) -> State:
        status: Status = "playing" if self._playing else "paused"
        if self._playing and self._next >= self._count and self._again is None:
            status = "ended"
        return State(status, max(self._next - 1, 0), self._speed)


def times_of(source: Source) -> Callable[[int], float]:
    """Return a function that gives the time of a frame, s, without rendering or reading the frame."""
    if isinstance(source, Recording):
        known = dict(source.indexed_times())
        if known:
            indices, times = np.array(list(known)), np.array(list(known.values()))
            return lambda index: float(np.interp(index, indices, times))
    arrivals = getattr(source, "arrivals", None)
    rate = source.rate_hz
    return lambda index: (index if arrivals is None else arrivals[index]) / rate
