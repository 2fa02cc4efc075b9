"""The exceptions of irtrack are irsim's: whoever runs a tracker opens sources, and one ``except`` catches both.

IrtrackError  anything raised on purpose; ``str(error)`` is ready to be shown to a user
InputError    what the user gave is wrong: a tracker's name, a parameter, a box, a recording (exit status 2)
TrackerError  a tracker did wrong while it ran (exit status 1)
"""

from __future__ import annotations

import traceback

from irsim.errors import InputError
from irsim.errors import IrsimError as IrtrackError

__all__ = ["InputError", "IrtrackError", "TrackerError"]


class TrackerError(IrtrackError):
    """A tracker raised, ended the program, or said what is no estimate; what it raised is the ``__cause__``.

    The text is one line: 'tracker: frame 7: ValueError: what'.
    """

    def trace(self) -> str:
        """How Python tells what the tracker raised, from the tracker's own code on; '' where it raised nothing."""
        cause = self.__cause__
        if cause is None:
            return ""
        ours = cause.__traceback__  # of who called the tracker
        return "".join(traceback.format_exception(type(cause), cause, ours.tb_next if ours else None)).rstrip()
