"""The command `irsim`, also as `python -m irsim`."""

from __future__ import annotations

import _thread
import signal
import sys
import time
from typing import Any

RAISE_AGAIN_S = 0.01
"""Delay, s, within which the callback that swallowed a KeyboardInterrupt has ended."""


def main() -> None:
    """Run the command; Ctrl-C ends it in one line, also while it is still imported."""
    keep_interrupts()
    try:
        from irsim.cli.app import main as command

        command()
    except KeyboardInterrupt:
        print("irsim: stopped", file=sys.stderr)
        sys.exit(130)


def keep_interrupts() -> None:
    """Raise a KeyboardInterrupt again where Python drops it: in callbacks and finalisers, as at the end of each import.

    A command interrupted there would run on.
    """
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            before(lost)
            return
        signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored after another signal
        _thread.start_new_thread(_interrupt_again, (_thread.get_ident(),))

    sys.unraisablehook = hook


def _interrupt_again(main: int) -> None:
    time.sleep(RAISE_AGAIN_S)
    if sys.platform == "win32":
        _thread.interrupt_main()
    else:
        signal.pthread_kill(main, signal.SIGINT)  # unlike interrupt_main it ends a wait, too


if __name__ == "__main__":
    main()
