"""Real time: a tracker gets the frames that a camera would give it, and those that come while it works are dropped.

The rule is that of the real-time experiment of VOT2017 (Kristan et al., ICCV workshops 2017): the tracker gets the
newest frame once it is done with the one before, and a dropped frame is scored with the last estimate. Time is that of
the camera and of the measured steps; rendering and reading cost none of it, and nothing waits.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from irsim.errors import is_number
from irsim.types import Frame
from irtrack.errors import InputError
from irtrack.replay.replay import Player
from irtrack.types import Track

RATES = (1e-3, 1e3)
"""Least and greatest factor of real time."""


class RealTime:
    """Player that passes on the frames of a camera at `rate` times its frame rate, as far as the tracker keeps up.

    dropped  (index, time s) of the frames that the tracker did not get
    """

    def __init__(self, player: Player, rate: float = 1.0) -> None:
        low, high = RATES
        if not is_number(rate) or not low <= rate <= high:
            raise InputError(f"rate {rate}: allowed: {low:g} to {high:g} times the camera's frame rate")
        self.player, self.rate = player, float(rate)
        self.dropped: list[tuple[int, float]] = []
        self._free_at = -math.inf
        self._newest: Frame | None = None

    def see(self, frame: Frame) -> None:
        """Take the next frame of the camera. Errors as those of `Player.see`."""
        arrival = frame.time / self.rate
        if self._newest is not None and self._free_at < arrival:
            self.finish()
        if self._newest is not None:
            self.dropped.append((self._newest.index, self._newest.time))
        self._newest = frame
        if self._free_at <= arrival:
            self.finish()

    def finish(self) -> None:
        """Pass on the newest frame that waits, once the tracker is done with the one before."""
        waiting, self._newest = self._newest, None
        if waiting is not None:
            self.player.see(waiting)
            begin = max(self._free_at, waiting.time / self.rate)
            self._free_at = begin + self.player.clock.step_ms[-1] / 1e3

    def held(self, track: Track) -> Track:
        """Return the track with the last estimate before it in each dropped frame, and with its step's times."""
        if not self.dropped:
            return track
        indices, times = (np.array(column) for column in zip(*self.dropped, strict=True))
        order = np.argsort(np.concatenate([track.indices, indices]), kind="stable")
        last = np.maximum.accumulate(np.where(order < len(track.indices), order, 0))
        return replace(
            track,
            indices=np.concatenate([track.indices, indices])[order],
            times=np.concatenate([track.times, times])[order],
            estimates=tuple(track.estimates[k] for k in last),
            step_ms=track.step_ms[last],
            cpu_ms=track.cpu_ms[last],
        )
