"""Child program over pipes: requests and answers line by line; a program that hangs is ended.

Threads write and read, so that no program, whether it prints without end or reads nothing, blocks the caller.
"""

from __future__ import annotations

import atexit
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from irtrack.errors import InputError, TrackerError

QUOTED = 300
"""Number of characters of the last output of a program that an error quotes."""
SETTLE_S = 5e-5
"""Pause before a request, s, in which a surplus answer to the last request is detected."""
CHUNK = 1 << 16
"""Number of bytes read at once: the capacity of a pipe."""
LONGEST_LINE = 1 << 24
"""Longest line that may be an answer, bytes."""
GRACE_S = 1.0
"""Time for a program to end by itself after a farewell, and for its last output to arrive after its end, s."""

Piece = bytes | np.ndarray
"""Part of a request: bytes, or an array whose bytes are sent."""


class Child:
    """Running program; where it dies or hangs, `ask` and `greeting` raise TrackerError and end it.

    prefix    first bytes of every answer; other lines are output of the program, kept for error messages
    farewell  request by which the program ends itself; empty: it is killed at once
    greets    True: the program sends a line before the first request
    """

    def __init__(
        self, command: Sequence[str], prefix: bytes = b"", farewell: bytes = b"", greets: bool = False
    ) -> None:
        """Start the program; InputError where it cannot be started."""
        pipe = subprocess.PIPE
        try:
            # The program runs in a process session of its own: Ctrl-C does not reach it, and its children end with it.
            self._process = subprocess.Popen(
                list(command), stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True
            )
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else None
            raise InputError(f"{command[0]}: cannot be started: {why or error}") from None
        self._prefix, self._farewell = prefix, farewell
        self._requests: queue.SimpleQueue[Sequence[Piece] | None] = queue.SimpleQueue()
        self._answers: queue.Queue[bytes] = queue.Queue(maxsize=1)
        # Count the answers due: a surplus answer must not pass for the answer to the next request.
        self._owed = int(greets)
        self._untimely = False
        self._answered = False
        self._said = b""
        self._threads = [_started(work) for work in (self._write, self._read_answers, self._read_errors)]
        atexit.register(self.close)

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def ask(self, request: Sequence[Piece], timeout_s: float) -> bytes:
        """Return the answer to a request, a line including its line end.

        TrackerError where the program has died, gives no answer within `timeout_s`, or had sent a line before the
        request.
        """
        time.sleep(SETTLE_S)
        self._owed += 1
        self._requests.put(request)
        return self.greeting(timeout_s)

    def greeting(self, timeout_s: float) -> bytes:
        """Return the line that the program sends at its start; TrackerError as in `ask`."""
        try:
            line = self._answers.get(timeout=timeout_s)
        except queue.Empty:
            self.close(farewell=False)
            raise TrackerError(f"its program gave no answer in {timeout_s:g} s{self._last_output()}") from None
        if self._untimely:
            raise self.refuse(f"its program answered {quoted(line)} without a request; allowed: one answer to each")
        if line.endswith(b"\n"):
            self._answered = True
            return line
        if len(line) < LONGEST_LINE:
            raise TrackerError(self._ending())
        raise self.refuse(f"its program answered a line of {LONGEST_LINE} bytes or more, {quoted(line)}")

    def refuse(self, why: str) -> TrackerError:
        """End the program; return the error to raise, with the reason."""
        self.close(farewell=False)
        return TrackerError(why)

    def close(self, farewell: bool = True) -> None:
        """End the program and its children, if it is still running."""
        atexit.unregister(self.close)
        if farewell and self._farewell and self.alive:
            self._requests.put([self._farewell])
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(GRACE_S)
        if self.alive:
            _kill(self._process)
        self._process.wait()
        self._requests.put(None)
        until = time.monotonic() + GRACE_S
        while any(thread.is_alive() for thread in self._threads) and time.monotonic() < until:
            with suppress(queue.Empty):  # the reading thread may wait until its last answer is taken
                self._answers.get(timeout=0.01)

    def _ending(self) -> str:
        """Return in words how a program with closed output ended; end it where it still runs."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_S)
        status = self._process.poll()
        self.close(farewell=False)
        if self._answered:
            return f"its program {_end(status)}{self._last_output()}"
        return f"its program {_end(status)} before its first answer{self._last_output() or '; it wrote nothing'}"

    def _last_output(self) -> str:
        words = " ".join(self._said.decode(errors="replace").split())[-QUOTED:]
        return f"; it last wrote: {words}" if words else ""

    def _write(self) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # the program has closed its end
            while (request := self._requests.get()) is not None:
                for piece in request:
                    self._process.stdin.write(
                        np.ascontiguousarray(piece).data if isinstance(piece, np.ndarray) else piece
                    )
                self._process.stdin.flush()
        with suppress(OSError):
            self._process.stdin.close()

    def _read_answers(self) -> None:
        assert self._process.stdout is not None
        given, rest = 0, b""
        with self._process.stdout as output:
            while len(rest) < LONGEST_LINE and (chunk := os.read(output.fileno(), CHUNK)):
                *lines, rest = (rest + chunk).split(b"\n")
                answers = [line + b"\n" for line in lines if line.startswith(self._prefix)]
                self._remember(b"\n".join(line for line in lines if not line.startswith(self._prefix)))
                given += len(answers)
                self._untimely = self._untimely or given > self._owed
                for answer in answers:
                    self._answers.put(answer)
                if not rest.startswith(self._prefix[: len(rest)]):  # output of the program, with or without a line end
                    self._remember(rest)
                    rest = b"..."
        if len(rest) < LONGEST_LINE:
            self._remember(rest)
            rest = b""
        self._answers.put(rest)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as output:
            while chunk := os.read(output.fileno(), CHUNK):
                self._remember(chunk)

    def _remember(self, words: bytes) -> None:
        self._said = (self._said + words)[-4 * QUOTED :]  # four bytes per character at most


def quoted(line: bytes) -> str:
    """Return a line of a program, shortened for an error message."""
    return repr(line if len(line) <= QUOTED else line[:QUOTED] + b"...")


def _started(work: Callable[[], None]) -> threading.Thread:
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


def _end(status: int | None) -> str:
    if status is None:
        return "closed its standard output"
    if status < 0:
        with suppress(ValueError):
            return f"was ended by {signal.Signals(-status).name}"
    return f"ended with status {status}"


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a process, with its children where there are process groups."""
    if sys.platform == "win32":
        process.kill()
        return
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
