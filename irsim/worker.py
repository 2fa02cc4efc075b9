"""A process that works for this one, and answers piece by piece through a pipe.

No pool of the standard library's: those have a thread that passes work on and takes answers, which waits until this
process has left its loops for Python. Workers were idle for a fifth of the time.
"""

from __future__ import annotations

import pickle
import select
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any, Generic, TypeVar

from irsim.interrupts import process

Answer = TypeVar("Answer")
Answering = Callable[..., Iterable[Any]]
"""What answers to a piece of work."""


class WorkerDiedError(Exception):
    """It answers no more."""


class _InWorkerError(Exception):
    """What a worker's traceback said, as the cause of what it raised."""


@dataclass(frozen=True)
class _Raised:
    error: Exception
    told: str


class Answers(Generic[Answer]):
    """Those to a piece of work, in order."""

    def __init__(self, worker: Worker, count: int) -> None:
        self._worker = worker
        self._to_come = count
        self._here: deque[Answer | _Raised] = deque()

    def put(self, answer: Answer | _Raised) -> bool:
        """One more has come; whether it was the last."""
        self._here.append(answer)
        self._to_come -= 1
        return self._to_come == 0

    def has_next(self) -> bool:
        """Whether `next` need not wait."""
        if not self._here:
            self._worker.listen()
        return bool(self._here) or self._worker.died

    def next(self) -> Answer:
        """Waits for the next one. What the worker raised is raised; WorkerDiedError where it died."""
        while not self._here:
            self._worker.hear()
        answer = self._here.popleft()
        if isinstance(answer, _Raised):
            raise answer.error from _InWorkerError(answer.told)
        return answer


class Worker:
    """A process in which begin(*inherited, *given) gives what is called with each piece of work and yields its answers.

    `inherited`: what is handed to a process only while it is started. Start it while `interrupts_held`.
    """

    def __init__(
        self, context: BaseContext, begin: Callable[..., Answering], *given: Any, inherited: Sequence[Any] = ()
    ) -> None:
        self._pipe, theirs = context.Pipe()
        self._has_come = _ear(self._pipe)
        self._process = process(context, _serve, begin, given, inherited=(theirs, inherited))
        self._asked: deque[Answers[Any]] = deque()
        self.died = False
        """As far as has been heard."""
        self._process.start()
        theirs.close()  # or its end would not be heard of

    def pieces(self) -> int:
        """How many it has yet to finish."""
        self.listen()
        return len(self._asked)

    def give(self, count: int, *work: Any) -> Answers[Any]:
        """A piece of work to which there are so many answers. Whoever waits for them is told if it has died."""
        answers: Answers[Any] = Answers(self, count)
        self._asked.append(answers)
        with suppress(OSError):
            self._pipe.send(work)
        return answers

    def listen(self) -> None:
        """What has come so far is taken from the pipe."""
        with suppress(WorkerDiedError):
            while self._asked and self._has_come():
                self.hear()

    def hear(self) -> None:
        """Waits for an answer."""
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            self.died = True
            raise WorkerDiedError from None
        if self._asked[0].put(answer):
            self._asked.popleft()

    def close(self) -> None:
        """It is ended, whatever it is at."""
        self._process.terminate()
        self._process.join()
        self._pipe.close()


def _ear(pipe: Connection) -> Callable[[], bool]:
    """Whether something has come by a pipe. Its own `poll` takes 25 us, as it makes a selector each time."""
    if not hasattr(select, "poll"):
        return pipe.poll
    polling = select.poll()
    polling.register(pipe.fileno(), select.POLLIN)
    return lambda: bool(polling.poll(0))


def _serve(pipe: Connection, inherited: Sequence[Any], begin: Callable[..., Answering], given: Sequence[Any]) -> None:
    try:
        answering = begin(*inherited, *given)
        while True:
            for answer in answering(*pipe.recv()):
                pipe.send(answer)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # nobody listens any more
    except Exception as error:
        raised = _Raised(error, traceback.format_exc())
        try:
            pickle.loads(pickle.dumps(raised))
        except Exception:
            raised = _Raised(RuntimeError(f"{type(error).__name__}: {error}"), raised.told)
        pipe.send(raised)
