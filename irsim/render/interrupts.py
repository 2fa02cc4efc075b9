"""Start and end of worker processes: Ctrl-C, scripts without a `__main__` guard, and the end of the parent process.

A terminal sends Ctrl-C to workers as well. Only the parent process reports it.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import Any

from irsim.errors import InputError

_ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that ask a program to end, and let it clean up."""

_hinting = threading.Lock()
"""Lock acquired by the first thread that prints the hint on the guard, and never released."""


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Defer Ctrl-C to the end of the block. Processes started in the block defer it too, until they run the function of
    `process` or call `ignore_interrupts`: an earlier Ctrl-C would end them with a traceback. InputError where no
    process can be started."""
    _expect_main()
    if sys.platform == "win32":
        with _guard_hint():
            yield
        return
    resource_tracker.ensure_running()  # started now, as its start unblocks signals
    with _guard_hint(), _deferred():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _expect_main() -> None:
    """Raise InputError where workers cannot import the main program, such as a program read from a pipe."""
    main = sys.modules["__main__"]
    path = getattr(main, "__file__", None)
    if getattr(main, "__spec__", None) is None and path is not None and not os.path.exists(path):
        what = f"worker processes cannot import the main program, {path}"
        raise InputError(f"{what}; allowed: one job, or a program in a file")


@contextmanager
def _guard_hint() -> Iterator[None]:
    """End a worker that imports a script without the `__main__` guard, with a hint of one line instead of a long
    traceback."""
    try:
        yield
    except RuntimeError as error:
        if "bootstrapping" not in str(error):
            raise
        hint = 'worker processes import this script too: put what it calls under if __name__ == "__main__":'
        if _hinting.acquire(blocking=False):
            sys.stderr.write(
                f"{hint}\n"
            )  # in one write, as other workers write too; a fork server drops sys.exit's text
            sys.stderr.flush()
        sys.exit(1)


@contextmanager
def _deferred() -> Iterator[None]:
    """Defer the Python handlers of SIGINT, SIGTERM and SIGHUP to the end of the block.

    A signal mask holds for one thread only: another thread, such as one of BLAS, may receive the signal, and Python
    runs the handler in the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # Signals without a handler in Python end the program at once.
    handlers = {number: handler for number in _ENDING if callable(handler := signal.getsignal(number))}
    came: list[int] = []  # a list: a second signal would wait for the lock that the first one holds in an Event
    for number in handlers:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


def process(
    context: BaseContext, function: Callable[..., None], *arguments: Any, inherited: Sequence[Any] = ()
) -> BaseProcess:
    """Return a process, not yet started, that calls `function(*inherited, *arguments)` and ends with its parent.

    `inherited` are arguments that can be passed only at the start of a process, such as shared memory. Ctrl-C ends the
    process at once and silently, even while it imports the function's module.
    """
    pickled = pickle.dumps((function, arguments))
    made: BaseProcess = context.Process(target=_begin, args=(pickled, *inherited), daemon=True)  # type: ignore[attr-defined]  # typeshed has it in the kinds of context only
    return made


def _begin(pickled: bytes, *inherited: Any) -> None:
    _handle_interrupts(lambda *_: os._exit(130))
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # it is ignored if the parent ignores it
    end_with_parent()
    function, arguments = pickle.loads(pickled)
    function(*inherited, *arguments)


def ignore_interrupts() -> None:
    """Ignore Ctrl-C in a worker whose parent ends it."""
    _handle_interrupts(signal.SIG_IGN)


def _handle_interrupts(handler: Any) -> None:
    signal.signal(signal.SIGINT, handler)
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


@contextmanager
def forks_ended() -> Iterator[None]:
    """End the copies that the block made of this process (os.fork), which would return from the block a second time."""
    process = os.getpid()
    try:
        yield
    finally:
        if os.getpid() != process:
            os._exit(1)


def end_with_parent() -> None:
    """End this worker as soon as its parent has ended, for any reason."""
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
