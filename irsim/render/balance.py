"""A controller that divides the steps of a frame between two processes, so that neither waits for the other."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

PROPORTIONAL, INTEGRAL = 0.1, 0.02
"""Gains of the controller: change of the worker's share of a frame's time for each piece of work that it is short of
the half that it should have left when it is given more. A piece of work is `Way.length` frames. As a share s more,
given throughout one piece, leaves 4 s more of it to do, the loop is damped by 0.7 of critical and settles within some
ten pieces."""


class Balance:
    """A proportional-integral controller of how many of a frame's first steps a worker takes.

    Its measurement is the work that the worker has left whenever it is given more, its set point half a piece, its
    output the worker's share of a frame's time. Steps are whole: what rounding leaves is carried to the next frame.
    """

    def __init__(self, always: float, steps: Sequence[float]) -> None:
        """always, the share of a frame's time that the worker has in any case; steps, the share of each step."""
        self._shares = list(accumulate(steps, initial=0.0))
        self._integral = self._share = self._within(0.5 - always)
        self._owed = 0.0

    def heed(self, left: float) -> None:
        """A measurement: the pieces of work that the worker has left when it is given another one."""
        short = 0.5 - left
        self._integral = self._within(self._integral + INTEGRAL * short)
        self._share = self._within(self._integral + PROPORTIONAL * short)

    def steps(self, count: int) -> list[int]:
        """How many steps the worker takes of each of the next `count` frames."""
        found = []
        for _ in range(count):
            self._owed += self._share
            found.append(max(bisect_right(self._shares, self._owed) - 1, 0))
            self._owed = min(self._owed - self._shares[found[-1]], self._shares[-1])
        return found

    def _within(self, share: float) -> float:
        return min(max(share, 0.0), self._shares[-1])
