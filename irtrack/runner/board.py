"""Which frame a tracker is working on, noted where the process that waits for it can read it."""

from __future__ import annotations

import math
from typing import Any, Protocol


class Watch(Protocol):
    """Told when a tracker begins to work on a frame, and when it is done."""

    def begin(self, member: int, frame: int, deadline: float) -> None:
        """Member number `member` is at `frame`; by time.monotonic() == `deadline` it must be done."""
        ...

    def end(self) -> None: ...


class Unwatched:
    """Nobody watches."""

    def begin(self, member: int, frame: int, deadline: float) -> None:
        pass

    def end(self) -> None:
        pass


class Board:
    """A `Watch` in memory that a process shares with its parent.

    It holds three numbers: the member at work (-1: none), the frame that it is at, or that was worked on last (-1: none
    yet), and the deadline by time.monotonic(), s.
    """

    EMPTY = (-1.0, -1.0, math.inf)

    def __init__(self, numbers: Any) -> None:
        self._numbers = numbers

    def begin(self, member: int, frame: int, deadline: float) -> None:
        self._numbers[0], self._numbers[1] = member, frame
        self._numbers[2] = deadline

    def end(self) -> None:
        self._numbers[2] = math.inf
        self._numbers[0] = -1
