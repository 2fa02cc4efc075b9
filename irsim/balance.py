"""How the steps of a frame that either of two processes may take are dealt out, so that neither waits for the other."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

AT_ONCE, LASTING = 0.1, 0.02
"""By what share of a frame's time a worker is given more, or less, of the next frames, and of all later ones, for as
much of a piece of work as it has less, or more, left than half. A share s given makes that left grow by 4 s a piece, so
that the two swing back as a spring damped by 0.7 of what would be critical, within some ten pieces."""


class Balance:
    """How many of the first steps of a frame are a worker's, beside what always is.

    Each frame has a whole number of them; what they have of a frame's time is right over several frames.
    """

    def __init__(self, always: float, steps: Sequence[float]) -> None:
        """Of a frame's time: the share that is a worker's always, and that of each step."""
        self._shares = list(accumulate(steps, initial=0.0))
        self._lasting = self._share = self._within(0.5 - always)
        self._owed = 0.0

    def heed(self, left: float) -> None:
        """How much a worker has left, in pieces of work, when it is given another one."""
        ahead = 0.5 - left
        self._lasting = self._within(self._lasting + LASTING * ahead)
        self._share = self._within(self._lasting + AT_ONCE * ahead)

    def steps(self, count: int) -> list[int]:
        """Those of each of so many frames more."""
        found = []
        for _ in range(count):
            self._owed += self._share
            found.append(max(bisect_right(self._shares, self._owed) - 1, 0))
            self._owed = min(self._owed - self._shares[found[-1]], self._shares[-1])
        return found

    def _within(self, share: float) -> float:
        return min(max(share, 0.0), self._shares[-1])
