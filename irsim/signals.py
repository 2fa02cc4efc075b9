"""Ctrl-C that Python loses, given again."""

from __future__ import annotations

import _thread
import signal
import sys
import time
from typing import Any

AGAIN_AFTER_S = 0.01
"""Long enough for the callback that swallowed it to end, too short for somebody at a terminal to notice."""


def no_interrupt_lost() -> None:
    """Raise KeyboardInterrupt anew where Python drops it: what is raised in callbacks and finalisers goes nowhere,
    and each import of a module ends in a callback. A command interrupted there would go on for hours."""
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            before(lost)
            return
        signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored: another signal was answered so
        _thread.start_new_thread(_interrupt_again, (_thread.get_ident(),))

    sys.unraisablehook = hook


def _interrupt_again(main: int) -> None:
    time.sleep(AGAIN_AFTER_S)
    if sys.platform == "win32":
        _thread.interrupt_main()
    else:
        signal.pthread_kill(main, signal.SIGINT)  # unlike the former it ends a wait, too
