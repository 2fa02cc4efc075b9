"""The errors by which a watched process tells that it is lost, or cannot be given its work."""

from __future__ import annotations

SENDABLE = "a class at the top level of a module's file, which makes what cannot be pickled in init or start"
"""What can be given to another process."""


class GoneError(Exception):
    """A watched process has ended, or was ended, before it answered.

    at        the numbers on its `Board` when it ended
    overdue   it was ended because it had passed its deadline
    moved     its board changed while it was being ended: it may have gone on to the next frame just in time
    how       how it ended, in words, such as 'SIGKILL'
    went_on   it closed its pipe but did not end: its board does not tell which tracker closed the pipe
    """

    def __init__(self, at: tuple[float, ...], overdue: bool, moved: bool, how: str, went_on: bool = False) -> None:
        super().__init__(how)
        self.at, self.overdue, self.moved, self.how, self.went_on = at, overdue, moved, how, went_on

    @property
    def member(self) -> int | None:
        """The number of the tracker that was at work then; None where none was."""
        return None if self.at[0] < 0 or self.went_on else int(self.at[0])

    @property
    def frame(self) -> int | None:
        """The frame that a tracker was at, or had been at last; None where none had begun."""
        return None if self.at[1] < 0 else int(self.at[1])

    @property
    def hung(self) -> bool:
        """Whether it was ended in the very frame that took too long."""
        return self.overdue and not self.moved


class NotSentError(Exception):
    """Work cannot be pickled for another process; the text is what pickle says, and what is allowed."""

    def __init__(self, error: Exception) -> None:
        super().__init__(f"{' '.join(str(error).split())}; allowed: {SENDABLE}")
