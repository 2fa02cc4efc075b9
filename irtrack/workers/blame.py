"""Whom it is laid to that a process was lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from irtrack.errors import WorkerError
from irtrack.workers.gone import GoneError

MOST_DEATHS = 2
"""A worker may be killed by chance once (memory, an operator); a tracker on which two died has killed them."""


@dataclass(frozen=True)
class Blame:
    """What is said of a tracker.

    member   its number;  frame  where it was, or had been last
    at_work  it was at work then; else it had been, and nobody beside it, and the source may have done it
    """

    member: int
    frame: int
    what: str
    at_work: bool


class Deaths:
    """On whom processes died over one piece of work; `name` is what messages call that."""

    def __init__(self, name: str = "") -> None:
        self._of: Counter[object] = Counter()
        self._name = name

    def blame(self, gone: GoneError, exceeded: str, asked: Sequence[object] = ("the tracker",)) -> Blame | None:
        """Of those that were asked in this process; None where they are to be asked again.

        exceeded   what is said of one that took too long

        WorkerError where processes died while nobody had been at work, more than twice.
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
