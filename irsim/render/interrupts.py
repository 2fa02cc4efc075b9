"""How worker processes start, with Ctrl-C, which a terminal sends to them too, and in scripts without a guard; how they
end with their parent."""

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
"""Signals by which programs are ended that may still tidy up."""

_hinting = threading.Lock()
"""Taken by who has told how a script asks for workers; this process ends with it."""


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Processes started within hold Ctrl-C back until they have begun, as a `process` or with `ignore_interrupts`.

    Else they would die of it with a traceback while they import. It reaches this process at the end of the block.
    InputError where no process can be started.
    """
    _expect_main()
    if sys.platform == "win32":
        with _in_few_words():
            yield
        return
    resource_tracker.ensure_running()  # it starts with the first worker otherwise, and ends the holding
    with _in_few_words(), _put_off():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _expect_main() -> None:
    """Worker processes read the program that asks for them anew: what came by a pipe is gone."""
    main = sys.modules["__main__"]
    path = getattr(main, "__file__", None)
    if getattr(main, "__spec__", None) is None and path is not None and not os.path.exists(path):
        what = f"worker processes cannot read the program that asks for them, {path}"
        raise InputError(f"{what}; allowed: one job, or a program in a file")


@contextmanager
def _in_few_words() -> Iterator[None]:
    """A worker that imports the script which asked for it, and is asked for workers in turn, ends with one line.

    A script without the guard does so. What multiprocessing raises then is a page long, from each worker anew.
    """
    try:
        yield
    except RuntimeError as error:
        if "bootstrapping" not in str(error):
            raise
        hint = 'worker processes import this script too: put what it calls under if __name__ == "__main__":'
        if _hinting.acquire(blocking=False):  # of the threads that ask for a worker each, one says it
            # As one text: another worker says the same. By itself: a fork server drops what sys.exit is given.
            sys.stderr.write(f"{hint}\n")
            sys.stderr.flush()
        sys.exit(1)


@contextmanager
def _put_off() -> Iterator[None]:
    """Ctrl-C within the block, and what else a program answers so, is answered at its end.

    The mask of one thread is not enough: another thread, such as those of a BLAS, takes the signal then, and Python
    answers it in the main thread all the same. A process that is only half started would end with a traceback, and
    whoever started it might wait for it for ever.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # Those without an answer in Python end the program at once.
    answers = {number: answer for number in _ENDING if callable(answer := signal.getsignal(number))}
    came: list[int] = []  # a lock, such as an Event's, would wait for itself if a second one came while it is taken
    for number in answers:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, answer in answers.items():
            signal.signal(number, answer)
        if came:
            signal.raise_signal(came[0])


def process(
    context: BaseContext, function: Callable[..., None], *arguments: Any, inherited: Sequence[Any] = ()
) -> BaseProcess:
    """A process, yet to be started, that calls `function(*inherited, *arguments)`, and ends with its parent.
    `inherited`: what is handed to a process only while it is started, such as memory that is shared.

    Ctrl-C ends such a worker at once and silently, also while it still imports what the function takes; its parent
    tells of it.
    """
    pickled = pickle.dumps((function, arguments))
    made: BaseProcess = context.Process(target=_begin, args=(pickled, *inherited), daemon=True)  # type: ignore[attr-defined]  # typeshed has it in the kinds of context only
    return made


def _begin(pickled: bytes, *inherited: Any) -> None:
    _answer(lambda *_: os._exit(130))
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a program that ignores it hands that on
    end_with_parent()
    function, arguments = pickle.loads(pickled)
    function(*inherited, *arguments)


def ignore_interrupts() -> None:
    """In a worker: Ctrl-C is left to its parent, which ends it."""
    _answer(signal.SIG_IGN)


def _answer(handler: Any) -> None:
    signal.signal(signal.SIGINT, handler)
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def end_with_parent() -> None:
    """In a worker: it ends as soon as its parent has ended, by whatever; else one at work would go on, and one that
    waits would wait for ever."""
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
