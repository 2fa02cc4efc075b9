"""Which tracker is to blame for a worker process that died or hung."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from irtrack.errors import WorkerError
from irtrack.runner.gone import GoneError

MOST_DEATHS = 2
"""A worker may be killed by chance once (memory, an operator); a tracker on which two died has killed them."""


@dataclass(frozen=True)
class Blame:
    """A tracker that killed worker processes, or hung in one.

    member   its number among the trackers of the work
    frame    the frame that it was at, or had been at last
    what     what it did, in words
    at_work  True: it was at work on that frame when the process ended. False: it no longer was, but it was the only
             tracker in the process; the source of the frames may have done it instead
    """

    member: int
    frame: int
    what: str
    at_work: bool


class Deaths:
    """Counts the processes that died over one piece of work, by tracker; `name` is what messages call the work."""

    def __init__(self, name: str = "") -> None:
        self._of: Counter[object] = Counter()
        self._name = name

    def blame(self, gone: GoneError, exceeded: str, asked: Sequence[object] = ("the tracker",)) -> Blame | None:
        """The tracker to blame for a lost process; None where the work is to be tried once more.

        exceeded   what is said of a tracker that took too long
        asked      the trackers that ran in the process, by number

        WorkerError from the third process on that died before any tracker was at work.
        """
        if gone.frame is None:
            self.of_nobody(gone.how)
            return None
        member, at_work = gone.member or 0, gone.member is not None
        if at_work and gone.hung:
            return Blame(member, gone.frame, exceeded, at_work)
        self._of[asked[member]] += 1
        if self._of[asked[member]] < MOST_DEATHS:
            return None
        when = "while the tracker was at work" if at_work else "after the tracker had been at work"
        return Blame(member, gone.frame, f"the process died {MOST_DEATHS} times {when} ({gone.how})", at_work)

    def of_nobody(self, how: str) -> None:
        """WorkerError where this is not the first time or the second."""
        self._of[None] += 1
        if self._of[None] > MOST_DEATHS:
            raise WorkerError(
                f"{self._name and f'{self._name}: '}a worker process died again and again while no tracker was at "
                f"work ({how})"
            ) from None
