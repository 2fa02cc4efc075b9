"""A program on the other end of two pipes: asked and answered line by line, ended where it hangs."""

from __future__ import annotations

import atexit
import json
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from typing import IO, Any

import numpy as np

from irtrack.errors import InputError, TrackerError

POLL_S = 0.1
"""How often the watch looks whether an answer is overdue."""
LAST_WORDS = 300
"""Letters of what the program last wrote to standard error that an error quotes."""


class Child:
    """A running program. It may die or hang at any time: `ask` then raises, and it is over with it."""

    def __init__(self, command: Sequence[str]) -> None:
        """Start it; InputError where it cannot be started."""
        self.name = command[0]
        self._said: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the program
        try:
            self._process = subprocess.Popen(
                list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said
            )
        except OSError as error:
            self._said.close()
            raise InputError(f"{command[0]}: cannot be started: {error.strerror or error}") from None
        self._overdue_at = float("inf")
        self._hangs = False
        threading.Thread(target=self._watch, daemon=True).start()
        atexit.register(self.close)

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def ask(self, request: dict[str, Any], image: np.ndarray, timeout_s: float) -> dict[str, Any]:
        """Its answer to a request with the bytes of an image after it.

        TrackerError where it has died, gives no answer within timeout_s, or one that is no JSON object.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._overdue_at = time.monotonic() + timeout_s
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.write(np.ascontiguousarray(image).data)
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except OSError:  # a pipe without anybody at its other end
            line = b""
        finally:
            self._overdue_at = float("inf")
        if not line.endswith(b"\n"):
            raise TrackerError(self._obituary(timeout_s))
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            self.close()
            raise TrackerError(f"its program answered {line[:LAST_WORDS]!r}; allowed: a line with a JSON object")
        return answer

    def close(self) -> None:
        """End it; nothing where it has ended."""
        atexit.unregister(self.close)
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._said):
            try:
                if pipe is not None:
                    pipe.close()
            except OSError:  # what could not be written any more
                pass

    def _obituary(self, timeout_s: float) -> str:
        """What became of it, in a line; it has ended or is ended now."""
        if not self._hangs:
            try:
                self._process.wait(POLL_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
        status = self._process.wait()
        self._said.seek(0)
        words = " ".join(self._said.read().decode(errors="replace").split())[-LAST_WORDS:]
        self.close()
        what = f"gave no answer in {timeout_s:g} s" if self._hangs else f"ended with status {status}"
        return f"its program {what}" + (f"; it last wrote: {words}" if words else "")

    def _watch(self) -> None:
        while self._process.poll() is None:
            if time.monotonic() > self._overdue_at:
                self._hangs = True
                self._process.kill()
            time.sleep(POLL_S)
