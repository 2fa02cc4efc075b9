"""The exceptions of irtrack are irsim's: whoever runs a tracker opens sources, and one ``except`` catches both.

IrtrackError  anything raised on purpose; ``str(error)`` is ready to be shown to a user
InputError    what the user gave is wrong: a tracker's name, a parameter, a box, a recording (exit status 2)
TrackerError  a tracker did wrong while it ran (exit status 1)
WorkerError   worker processes died or failed, and no tracker did it; what was finished by then counts
"""

from __future__ import annotations

import traceback
from types import TracebackType

from irsim.errors import InputError, exit_status_text, printable, whole_number
from irsim.errors import IrsimError as IrtrackError

__all__ = ["InputError", "IrtrackError", "TrackerError", "WorkerError", "exit_status_text", "told", "whole_number"]

_CALLERS = ("irtrack.replay.replay", "irtrack.trackers.adapters")
"""Modules that call a tracker."""


def told(error: BaseException) -> str:
    """What was raised, in one line: 'ValueError: what'."""
    try:
        said = " ".join(str(error).split())
    except Exception:  # somebody's own exception may fail at this, too
        said = ""
    return printable(f"{type(error).__name__}{said and f': {said}'}")


class WorkerError(IrtrackError):
    """Worker processes died or failed, and no tracker did it. Whoever keeps what was finished by then says so."""


class TrackerError(IrtrackError):
    """A tracker raised, ended the program, or said what is no estimate; what it raised is the ``__cause__``.

    The text is one line: 'tracker: frame 7: ValueError: what'.
    """

    def calls(self) -> str:
        """Where the tracker raised it: its own lines as Python writes them; '' where it raised nothing."""
        return printable("".join(traceback.format_tb(self._own())).rstrip())

    def trace(self) -> str:
        """The same with what was raised; '' where it raised nothing."""
        cause = self.__cause__
        return printable("".join(traceback.format_exception(type(cause), cause, self._own())).rstrip()) if cause else ""

    def _own(self) -> TracebackType | None:
        """The traceback without who called the tracker."""
        rest = self.__cause__.__traceback__ if self.__cause__ else None
        while rest is not None and rest.tb_frame.f_globals.get("__name__") in _CALLERS:
            rest = rest.tb_next
        return rest
