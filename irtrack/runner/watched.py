"""Worker processes that are ended when they pass a deadline, and whose end is told."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from time import monotonic
from typing import Any

from irsim.render.interrupts import ignore_interrupts, interrupts_held
from irtrack.errors import IrtrackError, exit_status_text, told
from irtrack.runner.beginning import begin_worker
from irtrack.runner.board import Board
from irtrack.runner.gone import SENDABLE, GoneError, NotSentError

POLL_S = 0.05
"""How often a watched process is looked at: so much later than its limit it may be ended."""

END_S = 10.0
"""How long a process whose pipe has ended may take to end itself: a core dump is written first."""

_reaping = threading.Lock()
"""Whoever starts a process asks all others whether they have ended (multiprocessing), and how is told only once: of two
threads that ask at the same time one would read nonsense."""


class Watched:
    """A worker process that does one piece of work after the other, and notes on a `Board` which frame it is at.

    The process calls begin(board, *given) once, and what that returns with each piece of work; the board is empty when
    a piece begins. The process is started for its first piece of work; after it was lost, another is started for the
    next piece.
    """

    def __init__(self, begin: Callable[..., Callable[[Any], Any]], *given: object) -> None:
        self._given = begin, given
        self._process: _Process | None = None
        self.closed = False

    def ask(self, work: object) -> Any:
        """The answer of the process to a piece of work; what the work raises is raised here.

        GoneError where the process died, or was ended because it passed its deadline; NotSentError where the work, or
        what `begin` is given, cannot be pickled.
        """
        sent = _pickled(work)
        try:
            process = self._ready()
            process.send(sent)
            answer = process.answer()
        except BaseException:  # Ctrl-C too: its answer would be taken for the next one's
            self._end()
            raise
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def _ready(self) -> _Process:
        if self._process is None:
            begun = _pickled((dict(os.environ), self._given))
            if not self.closed:
                self._process = _Process(begun)
            if self._process is None or self.closed:  # meanwhile
                raise GoneError(Board.EMPTY, overdue=False, moved=False, how="closed")
        return self._process

    def close(self) -> None:
        """End the process, whatever it is at, for good; whoever waits for it has a GoneError."""
        self.closed = True
        self._end()

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.close()


class _Process:
    """One process of a `Watched`."""

    def __init__(self, begun: bytes) -> None:
        context = _context()
        self._answered, self._closed = False, False
        self._board = context.RawArray("d", Board.EMPTY)
        with _reaping, interrupts_held():
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=_serve, args=(theirs, self._board, begun), daemon=True)
            self._process.start()
            theirs.close()

    def send(self, sent: bytes) -> None:
        self._board[:] = Board.EMPTY
        try:
            self._pipe.send_bytes(sent)
        except OSError:
            raise self._gone() from None

    def answer(self) -> Any:
        while not self._pipe.poll(POLL_S):
            at = tuple(self._board)
            if monotonic() > at[-1]:
                self.kill()
                raise self._gone(overdue=True, moved=at != tuple(self._board))
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            raise self._gone() from None
        self._answered = True
        return answer

    def _gone(self, overdue: bool = False, moved: bool = False) -> GoneError:
        code, at = self._exit_code(END_S), tuple(self._board)
        self.kill()
        if self._closed:  # by another thread
            return GoneError(at, overdue=False, moved=False, how="closed")
        if code and code > 0 and not self._answered and at == Board.EMPTY:  # not by chance: the next one would, too
            raise IrtrackError(
                f"a worker process ended as it began ({exit_status_text(code)}): what it imports ends it; a script "
                'that asks for workers is imported too, and needs the guard if __name__ == "__main__":'
            ) from None
        how = "it closed its pipe and went on" if code is None else exit_status_text(code)
        return GoneError(at, overdue, moved, how, went_on=code is None)

    def close(self) -> None:
        """End it, whatever it is at; who waits for it learns that it was closed."""
        self._closed = True
        self.kill()

    def kill(self) -> None:
        with _reaping:
            self._process.kill()
        self._exit_code()

    def _exit_code(self, within_s: float | None = None) -> int | None:
        """Of a process that ends, below 0 by a signal; None where it goes on for so long."""
        wait([self._process.sentinel], within_s)
        with _reaping:
            self._process.join(0)
            code: int | None = self._process.exitcode
            return code


def _context() -> Any:
    """How processes are started: safe with threads, as none is a copy of this one.

    On Linux they are copies of a server that has imported what this one had of irsim and irtrack when it began: 10 ms
    of CPU time in place of 1.2 s (Python 3.11). Of a tracker that dies a hundred trials take two hundred processes.
    """
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    ours = [name for name in list(sys.modules) if name.partition(".")[0] in ("irsim", "irtrack")]
    context.set_forkserver_preload([name for name in ours if not name.endswith("__main__")])
    return context


def _pickled(value: object) -> bytes:
    """What a pipe sends; it can be read by `pickle.loads`."""
    try:
        return bytes(ForkingPickler.dumps(value))
    except Exception as error:  # pickle raises all sorts
        raise NotSentError(error) from None


def _serve(pipe: Connection, board: Any, begun: bytes) -> None:
    """A process's life: work in, what comes of it out."""
    ignore_interrupts()  # of Ctrl-C the parent tells: one that is gone would be replaced
    begin_worker()
    run: Callable[[Any], Any] | None = None
    while True:
        answer: Any
        try:
            asked = pipe.recv_bytes()
        except EOFError:
            return
        try:
            if run is None:
                environment, (begin, given) = pickle.loads(begun)
                os.environ.update(environment)  # what has changed since the fork server began
                run = begin(Board(board), *given)
            work = pickle.loads(asked)
        except Exception as error:  # its module is not there, or raises while it is imported
            what = f"a worker process cannot read what it is to run: {told(error)}"
            unknown = isinstance(error, AttributeError | ImportError)  # such as what was typed into a notebook
            answer = IrtrackError(f"{what}; allowed: {SENDABLE}" if unknown else what)
        else:
            try:
                answer = run(work)
            except Exception as error:
                answer = error
        pipe.send_bytes(_answered(answer))


def _answered(answer: object) -> bytes:
    """What a pipe sends back; of what cannot be read there, or not be sent, what it says."""
    try:
        sent = bytes(ForkingPickler.dumps(answer))
        if isinstance(answer, Exception):
            pickle.loads(sent)  # fails where its class takes other arguments than Exception was given
    except Exception as error:  # pickle raises all sorts
        sent = bytes(ForkingPickler.dumps(IrtrackError(told(answer if isinstance(answer, Exception) else error))))
    return sent
