"""Exceptions of irtrack. Their base is that of irsim, so that one ``except`` catches both.

IrtrackError  any error raised on purpose; ``str(error)`` is a message for users
InputError    wrong input: a tracker's name, a parameter, a box, a recording (exit status 2)
TrackerError  error of a tracker while it ran (exit status 1)
WorkerError   worker processes died or failed, and no tracker caused it; finished results are kept
"""

from __future__ import annotations

import traceback
from types import TracebackType

from irsim.errors import InputError, exit_status_text, one_line, printable, whole_number
from irsim.errors import IrsimError as IrtrackError

__all__ = [
    "InputError",
    "IrtrackError",
    "TrackerError",
    "WorkerError",
    "error_line",
    "exit_status_text",
    "one_line",
    "whole_number",
]

_CALLERS = (
    "irtrack.replay.replay",
    "irtrack.replay.many",
    "irtrack.trackers.adapters",
    "irtrack.trackers.many_adapters",
    "irtrack.detectors.plain",
)
"""Modules that call a tracker: tracebacks omit them."""


def error_line(error: BaseException) -> str:
    """Return type and text of an exception in one line: 'ValueError: text'."""
    try:
        said = " ".join(str(error).split())
    except Exception:  # the `__str__` of a user's exception class may raise, too
        said = ""
    return printable(f"{type(error).__name__}{said and f': {said}'}")


class WorkerError(IrtrackError):
    """Worker processes died or failed, and no tracker caused it."""


class TrackerError(IrtrackError):
    """A tracker raised, ended the program, or gave no valid estimate; its exception is the ``__cause__``.

    The text is one line: 'tracker: frame 7: ValueError: text'.
    """

    def calls(self) -> str:
        """Return the part of the traceback inside the tracker; '' where the tracker raised nothing."""
        return printable("".join(traceback.format_tb(self._own())).rstrip())

    def trace(self) -> str:
        """Return the traceback inside the tracker with the exception; '' where the tracker raised nothing."""
        cause = self.__cause__
        return printable("".join(traceback.format_exception(type(cause), cause, self._own())).rstrip()) if cause else ""

    def _own(self) -> TracebackType | None:
        """Return the traceback without the callers of the tracker."""
        rest = self.__cause__.__traceback__ if self.__cause__ else None
        while rest is not None and rest.tb_frame.f_globals.get("__name__") in _CALLERS:
            rest = rest.tb_next
        return rest
