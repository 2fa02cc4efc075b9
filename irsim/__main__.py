"""The command `irsim`, also as `python -m irsim`."""

from __future__ import annotations

import _thread
import signal
import sys
import time
from importlib import import_module
from typing import Any

REPEAT_AFTER_S = 0.01
"""Delay before a lost Ctrl-C is raised again, s: the callback that swallowed it has ended by then."""


def main() -> None:
    """Run the command."""
    run_command("irsim", "irsim.cli.app")


def run_command(name: str, module: str) -> None:
    """Import a command's module and call its `main`. Ctrl-C ends the command quietly, also while it is imported."""
    keep_interrupts()
    try:
        import_module(module).main()
    except KeyboardInterrupt:
        print(f"{name}: stopped", file=sys.stderr)
        sys.exit(130)


def keep_interrupts() -> None:
    """Raise KeyboardInterrupt again where Python drops it.

    Python ignores exceptions in callbacks and finalisers, and each import of a module ends in a callback: a command
    interrupted there would run on.
    """
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            before(lost)
            return
        signal.signal(signal.SIGINT, signal.default_int_handler)  # an earlier signal may have set it to be ignored
        _thread.start_new_thread(_interrupt, (_thread.get_ident(),))

    sys.unraisablehook = hook


def _interrupt(main_thread: int) -> None:
    time.sleep(REPEAT_AFTER_S)
    if sys.platform == "win32":
        _thread.interrupt_main()
    else:
        signal.pthread_kill(main_thread, signal.SIGINT)  # unlike interrupt_main it also ends a wait


if __name__ == "__main__":
    main()
