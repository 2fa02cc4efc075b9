"""Watchdog of trackers in worker processes: detection of hangs, and attribution of crashes to a tracker.

A worker writes the frame at work and its deadline into a `Heartbeat`, memory shared with the process that waits for
it. The waiting process (`worker.Worker`) checks `Heartbeat.is_overdue`, and ends an overdue worker. `CrashCount`
decides whether the end of a process is blamed on a tracker (`Blame`) or the work is tried again.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic
from typing import Any, Literal

from irsim.render.interrupts import forks_ended
from irtrack.errors import TrackerError, WorkerError

MAX_CRASHES = 2
"""Number of crashes after which a tracker is blamed; a single crash may have another cause (memory, an operator)."""


@dataclass(frozen=True)
class Limit:
    """Limit of the wall time of a tracker without rendering, in a whole run or for each frame."""

    seconds: float
    of: Literal["run", "frame"]

    def left(self, spent_s: float) -> float:
        """Return the time left for the next frame, s, after the run has taken `spent_s`."""
        return self.seconds - spent_s * (self.of == "run")

    def exceeded(self) -> str:
        """Return the error message for a tracker that exceeded the limit."""
        verb = "timed out" if self.of == "run" else "hangs"
        return f"{verb}: more than {self.seconds:g} s in the tracker"


NO_LIMIT = Limit(math.inf, "run")


class Heartbeat:
    """Record of the frame that a tracker is working on.

    numbers   number of the member (tracker run) at work (-1: none), index of its frame or of the last one (-1: none
              yet), and deadline by time.monotonic(), s; in memory shared with the waiting process, or in a list
    """

    IDLE = (-1.0, -1.0, math.inf)

    @staticmethod
    def is_overdue(numbers: Sequence[float]) -> bool:
        """Return whether the frame at work is past its deadline, so that the tracker hangs."""
        return monotonic() > numbers[2]

    def __init__(self, limit: Limit = NO_LIMIT, numbers: Any = None) -> None:
        self.limit = limit
        self.overdue = False
        """True: the last frame took longer than its limit."""
        self._numbers = list(self.IDLE) if numbers is None else numbers
        self._spent_s: defaultdict[int, float] = defaultdict(float)

    @contextmanager
    def frame(self, index: int, member: int = 0) -> Iterator[None]:
        """Record the member and frame at work within the block; the record stays where the block ends the process."""
        begin, left = monotonic(), self.limit.left(self._spent_s[member])
        self._numbers[0], self._numbers[1], self._numbers[2] = member, index, begin + left
        try:
            with forks_ended():
                yield
        except Exception:
            self._end(member, begin, left)
            raise
        self._end(member, begin, left)

    def _end(self, member: int, begin: float, left: float) -> None:
        self._numbers[2] = math.inf
        self._numbers[0] = -1
        took = monotonic() - begin
        self._spent_s[member] += took
        self.overdue = took > left


class WorkerDiedError(Exception):
    """A worker process ended, or was ended, before it answered.

    at        numbers of its `Heartbeat` when it ended
    overdue   True: it was ended because its frame was past the deadline
    moved     True: its heartbeat changed while it was being ended, so that the frame may have met its deadline
    how       how it ended, in words, such as 'SIGKILL'
    went_on   True: it closed its pipe but did not end; the tracker that closed the pipe is unknown
    """

    def __init__(self, at: tuple[float, ...], overdue: bool, moved: bool, how: str, went_on: bool = False) -> None:
        super().__init__(how)
        self.at, self.overdue, self.moved, self.how, self.went_on = at, overdue, moved, how, went_on

    @property
    def member(self) -> int | None:
        """Number of the member that was at work; None where none was."""
        return None if self.at[0] < 0 or self.went_on else int(self.at[0])

    @property
    def frame(self) -> int | None:
        """Frame that a member was working on, or had worked on last; None where none had begun."""
        return None if self.at[1] < 0 else int(self.at[1])

    @property
    def hung(self) -> bool:
        """True: the worker was ended in the frame that exceeded its limit."""
        return self.overdue and not self.moved


@dataclass(frozen=True)
class Blame:
    """Blame on a tracker that killed worker processes, or hung in one.

    frame    frame that it was working on, or had worked on last
    what     what the tracker did, in words
    at_work  False: no tracker was at work when the process ended, but this one was the only one in it; the source of
             the frames may be the cause
    """

    frame: int
    what: str
    at_work: bool


class TrackerLostError(TrackerError):
    """A tracker killed the processes in which it ran, or hung; `limit`: its time limit."""

    def __init__(self, blame: Blame, limit: Limit) -> None:
        super().__init__(f"frame {blame.frame}: {blame.what}")
        self.blame, self.limit = blame, limit


class CrashCount:
    """Counts of processes that died in one call, by the member (tracker run) at work; `name`: for messages."""

    def __init__(self, name: str = "") -> None:
        self._of: Counter[int | None] = Counter()
        self._name = name

    def add(self, died: WorkerDiedError, limit: Limit, members: Sequence[int]) -> tuple[int, Blame] | None:
        """Count a process that died while running `members`; return the member to blame, or None to try again.

        WorkerError when a third process has died before any member was at work.
        """
        if died.frame is None:
            self.add_unexplained(died.how)
            return None
        member, at_work = members[died.member or 0], died.member is not None
        if at_work and died.hung:
            return member, Blame(died.frame, limit.exceeded(), at_work)
        self._of[member] += 1
        if self._of[member] < MAX_CRASHES:
            return None
        when = "while the tracker was at work" if at_work else "after the tracker had been at work"
        return member, Blame(died.frame, f"the process died {MAX_CRASHES} times {when} ({died.how})", at_work)

    def add_unexplained(self, how: str) -> None:
        """Count a process that died while no member was at work; raise WorkerError at the third."""
        self._of[None] += 1
        if self._of[None] > MAX_CRASHES:
            raise WorkerError(
                f"{self._name and f'{self._name}: '}a worker process died again and again while no tracker was at "
                f"work ({how})"
            ) from None
