"""Crash reporter: another process reports the frame at which a tracker ended the process of `irtrack run`.

A tracker may end it by `os._exit`, from native code, or by SIGKILL. The reporter is a copy of the process, forked
before threads start and libraries load. It sleeps until the first process ends. The tracker stays in the first process,
to which debuggers and profilers attach. It exists only on Linux: on other systems copying the process is not safe.
"""

from __future__ import annotations

import mmap
import os
import select
import signal
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from irtrack.errors import exit_status_text

if TYPE_CHECKING:
    from irsim.types import Frame

PROGRESS = struct.Struct("<?q")
"""Progress in shared memory: True while the tracker works on a frame; index of this frame or of the last one, or -1."""

FRESH_LINE = b"\r\x1b[K\x1b[?25h"
"""Control sequence that clears the line and shows the cursor after a progress bar (ECMA-48; xterm's DECTCEM)."""


class CrashReporter:
    """Memory shared with the reporting process, with the progress of a tracker and the last line of the report."""

    def __init__(self, note: str) -> None:
        self._memory = mmap.mmap(-1, 16 * mmap.PAGESIZE)
        self.progress = False, -1
        self.note(note)

    @property
    def progress(self) -> tuple[bool, int]:
        at_work, frame = PROGRESS.unpack_from(self._memory)
        return at_work, frame

    @progress.setter
    def progress(self, value: tuple[bool, int]) -> None:
        PROGRESS.pack_into(self._memory, 0, *value)

    def note(self, line: str) -> None:
        """Replace the last line of the report, which states the source and the command that repeats the run."""
        text = line.encode(errors="replace")[: len(self._memory) - PROGRESS.size - 1] + b"\0"
        self._memory[PROGRESS.size : PROGRESS.size + len(text)] = text

    def watching(self, see: Callable[[Frame], None]) -> Callable[[Frame], None]:
        """Return a function that calls `see` on a frame, and records this progress."""

        def seen(frame: Frame) -> None:
            self.progress = True, frame.index
            see(frame)
            self.progress = False, frame.index

        return seen

    def report(self, headline: str, how: str) -> bytes:
        """Return the text that reports how the process of the tracker ended; `how`: signal or exit status in words."""
        at_work, frame = self.progress
        if at_work:
            words = f"frame {frame}: the process died while the tracker was at work ({how})"
        elif frame < 0:
            words = f"the process died before the first frame ({how})"
        else:
            words = f"the process died after frame {frame}, while the tracker was not at work ({how})"
        note = self._memory[PROGRESS.size :].partition(b"\0")[0]
        return f"{headline}: {words}\n".encode(errors="replace") + note + b"\n"


@contextmanager
def crash_reporter(tracker: str, note: str) -> Iterator[CrashReporter]:
    """Yield a reporter that writes to standard error if this process ends within the block."""
    reporter, child = CrashReporter(note), None
    try:
        if sys.platform == "linux":
            child = _start(reporter, f"irtrack: {tracker}")
        yield reporter
    finally:
        if child is not None:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _start(reporter: CrashReporter, headline: str) -> int:
    """Return the id of the reporting process, which Ctrl-C does not reach."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    try:
        parent = os.getpid()
        child = os.fork()
        if child == 0:
            _wait_and_report(parent, reporter, headline)
        return child
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _wait_and_report(parent: int, reporter: CrashReporter, headline: str) -> NoReturn:
    """Sleep until the parent has ended, then write the report, without flushing or closing files of the parent."""
    with suppress(Exception):
        select.select([os.pidfd_open(parent)], [], [])
        os.write(2, FRESH_LINE * os.isatty(2) + reporter.report(headline, _how_it_ended(parent)))
    os._exit(0)


def _how_it_ended(process: int) -> str:
    """Return the signal or exit status of a process in words, by field 52 of stat in proc(5), if still readable."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return exit_status_text(os.waitstatus_to_exitcode(int(fields[52 - 3])))
    except (OSError, ValueError):
        return "its exit status tells how"
