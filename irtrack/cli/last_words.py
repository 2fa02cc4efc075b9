"""What another process says where a tracker ends the one that runs it: by `os._exit`, from native code, by SIGKILL."""

from __future__ import annotations

import mmap
import os
import select
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from irtrack.errors import exit_status_text

if TYPE_CHECKING:
    from irsim.types import Frame

END = b"\0"
"""Ends what is said; no command line holds it."""

NO_MORE = END + END
"""Nothing is said: this process speaks for itself."""

POLL_S = 0.5
"""How often the parent is looked for, where the end of the pipe does not tell."""

FRESH_LINE = b"\r\x1b[K\x1b[?25h"
"""To the line's begin, the line cleared, the cursor shown (ECMA-48; xterm's DECTCEM): a progress bar had both."""


class LastWords:
    """What is said where this process ends without a word of its own.

    board  two numbers that both processes see: whether the tracker is at work, and at which frame it is, or was last;
           before the first one 0, -1
    """

    def __init__(self, pipe: int | None, board: memoryview) -> None:
        self._pipe = pipe
        self.board = board

    def watching(self, see: Callable[[Frame], None]) -> Callable[[Frame], None]:
        """The same viewer of frames, with a note of each."""

        def seen(frame: Frame) -> None:
            self.board[1] = frame.index
            self.board[0] = True
            see(frame)
            self.board[0] = False

        return seen

    def where(self, line: str) -> None:
        """Say this, too: on what, and how to repeat it."""
        self._say(line.encode(errors="replace"))

    def none(self) -> None:
        """From now on this process speaks for itself."""
        self._say(b"")

    def _say(self, words: bytes) -> None:
        if self._pipe is not None:
            with suppress(OSError):  # whoever listened was killed
                os.write(self._pipe, words + END)


@contextmanager
def last_words(tracker: str, where: str) -> Iterator[LastWords]:
    """Another process says within the block where the tracker was when this one ended, and how.

    It is a copy of this one, made before there are threads and libraries, which sleeps until the pipe from here ends.
    So the tracker runs where debuggers and profilers look for it. Only Linux has it: elsewhere a copy of a process with
    threads is not safe, or there is none.
    """
    board = memoryview(mmap.mmap(-1, mmap.PAGESIZE)).cast("q")
    board[1] = -1
    if sys.platform != "linux":
        yield LastWords(None, board)
        return
    listener, pipe = os.pipe()
    words, child = LastWords(pipe, board), None
    try:
        child = _start(listener, pipe, f"irtrack: {tracker}", board)
        words.where(where)
        yield words
    finally:
        words.none()
        os.close(pipe)
        if child is not None:
            os.waitpid(child, 0)


def _start(listener: int, pipe: int, headline: str, board: memoryview) -> int:
    """The number of the process that listens."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # Ctrl-C is not meant for it
    try:
        parent = os.getpid()
        child = os.fork()
        if child == 0:
            os.close(pipe)
            _listen(listener, parent, headline, board)
        os.close(listener)
        return child
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _listen(pipe: int, parent: int, headline: str, board: memoryview) -> NoReturn:
    """The other process's life; nothing that it was copied with is flushed or closed."""
    with suppress(Exception):
        said = b""
        while not said.endswith(NO_MORE):
            some = _more(pipe, parent)
            if not some:
                where, words = said.split(END)[-2], f"{headline}: {_died(board, _how_it_ended(parent))}\n"
                os.write(2, FRESH_LINE * os.isatty(2) + words.encode(errors="replace") + where + b"\n")
                break
            said += some
    os._exit(0)


def _more(pipe: int, parent: int) -> bytes:
    """What else is said; nothing where the parent has ended, also where a process that its tracker forked, and that
    has the pipe too, has not."""
    while not select.select([pipe], [], [], POLL_S)[0]:
        if os.getppid() != parent:
            return b""
    return os.read(pipe, mmap.PAGESIZE)


def _died(board: memoryview, how: str) -> str:
    at_work, frame = board[0], board[1]
    if at_work:
        return f"frame {frame}: the process died while the tracker was at work ({how})"
    if frame < 0:
        return f"the process died before the first frame ({how})"
    return f"the process died after frame {frame}, while the tracker was not at work ({how})"


def _how_it_ended(process: int) -> str:
    """In words; field 52 of proc(5)'s stat, which waits for whoever started the process to take it."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return exit_status_text(os.waitstatus_to_exitcode(int(fields[52 - 3])))
    except (OSError, ValueError):
        return "its exit status tells how"
