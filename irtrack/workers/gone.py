"""What a watched process may come to."""

from __future__ import annotations

SENDABLE = "a class at the top level of a module's file, which makes what cannot be pickled in init or start"
"""What can be given to another process."""


class GoneError(Exception):
    """A watched process is gone.

    at        its `Board` then
    overdue   it was ended, for it took too long;  moved  its board changed while it was: it may just have gone on
    how       how it ended, in words
    went_on   its pipe was closed and yet it did not end: its board says nothing of who closed that
    """

    def __init__(self, at: tuple[float, ...], overdue: bool, moved: bool, how: str, went_on: bool = False) -> None:
        super().__init__(how)
        self.at, self.overdue, self.moved, self.how, self.went_on = at, overdue, moved, how, went_on

    @property
    def member(self) -> int | None:
        """Who was at work then; None where nobody was."""
        return None if self.at[0] < 0 or self.went_on else int(self.at[0])

    @property
    def frame(self) -> int | None:
        """At which frame somebody was, or had been last; None where nobody had been."""
        return None if self.at[1] < 0 else int(self.at[1])

    @property
    def hung(self) -> bool:
        """Was it ended at what it was at for too long?"""
        return self.overdue and not self.moved


class NotSentError(Exception):
    """Work cannot be sent to another process; what pickle says, in one line, and what is allowed."""

    def __init__(self, error: Exception) -> None:
        super().__init__(f"{' '.join(str(error).split())}; allowed: {SENDABLE}")
