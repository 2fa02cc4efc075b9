"""How work that may be done by a worker or by this process is dealt out, so that neither waits for the other."""

from __future__ import annotations

AT_ONCE, LASTING = 1.0, 0.1
"""By how many steps a worker is given more, or less, of the next frames, and of all later ones, for as much of a piece
of work as it has less, or more, left than half. With these the full chain gets into step within thirty pieces."""


class Balance:
    """How many steps of a frame are a worker's, beside what always is: from none to `most`. Steps are whole; a mean in
    between gives some frames one more than others."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lasting = self._mean = self._owed = 0.0

    @property
    def exhausted(self) -> bool:
        """Whether workers cannot be relieved of any more."""
        return self._lasting == 0

    def heed(self, left: float) -> None:
        """How much a worker has left, in pieces of work, when it is given another one."""
        ahead = 0.5 - left
        self._lasting = self._within(self._lasting + LASTING * ahead)
        self._mean = self._within(self._lasting + AT_ONCE * ahead)

    def steps(self, count: int) -> list[int]:
        """Those of each of so many frames more."""
        found = []
        for _ in range(count):
            self._owed += self._mean
            found.append(int(self._owed))
            self._owed -= found[-1]
        return found

    def _within(self, mean: float) -> float:
        return min(max(mean, 0.0), self._most)
