"""Worker process, which runs functions sent to it, one after the other, with one thread and its own numpy seed.

`Worker.call` waits for the answer. It ends a process whose heartbeat is overdue (`irtrack.runner.watchdog`).
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import Any

import cv2
import numpy as np

from irsim.render.interrupts import end_with_parent, forks_ended, ignore_interrupts, interrupts_held
from irtrack.errors import IrtrackError, error_line, exit_status_text
from irtrack.runner.watchdog import Heartbeat, Limit, WorkerDiedError

POLL_S = 0.05
"""Period at which heartbeats are read, s, the largest delay of a time limit."""

END_S = 10.0
"""Longest time from the end of a process' pipe to the end of the process, s, in which it may write a core dump."""

SENDABLE = "a class at the top level of a module's file; objects that cannot be pickled are made in init or start"
"""Description, for messages, of trackers that can be sent to another process."""

_reaping = threading.Lock()
"""Lock for reading exit statuses, which can be read only once; `multiprocessing` reads all when it starts a process."""


class NotSentError(Exception):
    """Work cannot be pickled for another process; the text is that of pickle, then the allowed objects."""

    def __init__(self, error: Exception) -> None:
        super().__init__(f"{' '.join(str(error).split())}; allowed: {SENDABLE}")


@contextmanager
def one_thread() -> Iterator[None]:
    """Restrict OpenCV to one thread within the block, so that measured times are those of one thread."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


class Worker:
    """Worker: a process that runs functions one at a time; it is started by the first call and replaced when it
    dies."""

    def __init__(self) -> None:
        self._process: _Process | None = None
        self.closed = False

    def call(self, limit: Limit, function: Callable[..., Any], *arguments: object) -> Any:
        """Return function(heartbeat, *arguments) from the process, or raise its exception.

        WorkerDiedError where the process died or hung; NotSentError where the work cannot be pickled.
        """
        work = _pickled((limit, function, arguments))
        try:
            process = self._ready()
            process.send(work)
            answer = process.answer()
        except BaseException:  # also after Ctrl-C: the next call must not read this answer
            self._end()
            raise
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def _ready(self) -> _Process:
        if self._process is None:
            if not self.closed:
                self._process = _Process()
            if self._process is None or self.closed:  # closed meanwhile
                raise WorkerDiedError(Heartbeat.IDLE, overdue=False, moved=False, how="closed")
        return self._process

    def close(self) -> None:
        """End the process for good, even at work; a thread that waits for its answer gets a WorkerDiedError."""
        self.closed = True
        self._end()

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.close()


class _Process:
    """One process of a `Worker`."""

    def __init__(self) -> None:
        context = _context()
        self._answered, self._closed = False, False
        self._heartbeat = context.RawArray("d", Heartbeat.IDLE)
        with _reaping, interrupts_held():
            self._pipe, theirs = context.Pipe()
            given = theirs, self._heartbeat, dict(os.environ)
            self._process = context.Process(target=_serve, args=given, daemon=True)
            with _children_allowed():
                self._process.start()
            theirs.close()

    def send(self, work: bytes) -> None:
        self._heartbeat[:] = Heartbeat.IDLE
        try:
            self._pipe.send_bytes(work)
        except OSError:
            raise self._died() from None

    def answer(self) -> Any:
        while not self._pipe.poll(POLL_S):
            at = tuple(self._heartbeat)
            if Heartbeat.is_overdue(at):
                self.kill()
                raise self._died(overdue=True, moved=at != tuple(self._heartbeat))
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            raise self._died() from None
        self._answered = True
        return answer

    def _died(self, overdue: bool = False, moved: bool = False) -> WorkerDiedError:
        code, at = self._exit_code(END_S), tuple(self._heartbeat)
        self.kill()
        if self._closed:  # by another thread
            return WorkerDiedError(at, overdue=False, moved=False, how="closed")
        if (
            code and code > 0 and not self._answered and at == Heartbeat.IDLE
        ):  # the cause is not chance: the next process would end, too
            raise IrtrackError(
                f"a worker process ended at its start ({exit_status_text(code)}): a module that it imports ends it; a "
                'script that starts workers is imported, too, and needs the guard if __name__ == "__main__":'
            ) from None
        how = "it closed its pipe and went on" if code is None else exit_status_text(code)
        return WorkerDiedError(at, overdue, moved, how, went_on=code is None)

    def close(self) -> None:
        self._closed = True
        self.kill()

    def kill(self) -> None:
        with _reaping:
            self._process.kill()
        self._exit_code()

    def _exit_code(self, within_s: float | None = None) -> int | None:
        """Return the exit code, below 0 for a signal; None where the process still runs after `within_s`."""
        wait([self._process.sentinel], within_s)
        with _reaping:
            self._process.join(0)
            code: int | None = self._process.exitcode
            return code


@contextmanager
def _children_allowed() -> Iterator[None]:
    """Let a daemonic process, such as a worker of dask, start a process in the block.

    `multiprocessing` forbids it, as the children of a daemonic process would outlive it; a worker ends with its parent
    (`end_with_parent`).
    """
    config: dict[str, Any] = multiprocessing.current_process()._config  # type: ignore[attr-defined]  # no public way
    daemonic = config.pop("daemon", None)
    try:
        yield
    finally:
        if daemonic is not None:
            config["daemon"] = daemonic


def _context() -> Any:
    """Return the multiprocessing context, which never copies this process, as its threads may hold locks.

    On Linux workers are copies of a fork server that has imported the loaded modules of irsim and irtrack, which takes
    10 ms of CPU time per worker instead of 1.2 s (Python 3.11).
    """
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    ours = [name for name in list(sys.modules) if name.partition(".")[0] in ("irsim", "irtrack")]
    context.set_forkserver_preload([name for name in ours if not name.endswith("__main__")])
    return context


def _pickled(value: object) -> bytes:
    """Return the pickled bytes of a value, to be sent by a pipe and read by `pickle.loads`."""
    try:
        return bytes(ForkingPickler.dumps(value))
    except Exception as error:  # pickle raises all sorts
        raise NotSentError(error) from None


def _serve(pipe: Connection, numbers: Any, environment: Mapping[str, str]) -> None:
    """Run each function from the pipe, and answer with its result or exception, until the pipe ends."""
    ignore_interrupts()  # the parent handles Ctrl-C
    cv2.setNumThreads(1)
    np.random.seed()  # noqa: NPY002 - for trackers with global random numbers: copies of the fork server share one seed
    end_with_parent()
    os.environ.update(environment)  # the fork server has the environment of its own start
    while True:
        answer: Any
        try:
            work = pipe.recv_bytes()
        except EOFError:
            return
        try:
            limit, function, arguments = pickle.loads(work)
        except Exception as error:  # its module is missing, or raises while it is imported
            what = f"a worker process cannot read what it is to run: {error_line(error)}"
            unknown = isinstance(error, AttributeError | ImportError)  # such as a class of a notebook
            answer = IrtrackError(f"{what}; allowed: {SENDABLE}" if unknown else what)
        else:
            try:
                with forks_ended():
                    answer = function(Heartbeat(limit, numbers), *arguments)
            except Exception as error:
                answer = error
        pipe.send_bytes(_answered(answer))


def _answered(answer: object) -> bytes:
    """Return the pickled answer; where it cannot be pickled or read back, an IrtrackError with its text."""
    try:
        sent = bytes(ForkingPickler.dumps(answer))
        if isinstance(answer, Exception):
            pickle.loads(sent)  # fails for exception classes with arguments of their own
    except Exception as error:  # pickle raises all sorts
        sent = bytes(ForkingPickler.dumps(IrtrackError(error_line(answer if isinstance(answer, Exception) else error))))
    return sent


def call_in_new_interpreter(function: Callable[..., Any], *arguments: object, **environment: str) -> Any:
    """Return function(*arguments) from a new Python with these environment variables, such as another PYTHONHASHSEED.

    NotSentError where function or arguments cannot be pickled; RuntimeError, with the last line of standard error,
    where the interpreter failed.
    """
    done = subprocess.run(
        [sys.executable, "-m", "irtrack.runner.worker"],
        input=_pickled((function, arguments)),
        capture_output=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), **environment},
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(done.stderr.decode(errors="replace").strip().splitlines()[-1])
    return pickle.loads(done.stdout)


def main() -> None:
    """Run the function that `call_in_new_interpreter` sends by standard input; answer by standard output."""
    function, arguments = pickle.load(sys.stdin.buffer)
    out, sys.stdout = sys.stdout, sys.stderr
    out.buffer.write(pickle.dumps(function(*arguments)))


if __name__ == "__main__":
    main()
