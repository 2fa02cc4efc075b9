"""A process that works for this one, and answers piece by piece through a pipe.

No pool of the standard library's: those have a thread that passes work on and takes answers, which waits until this
process has left its loops for Python. Workers were idle for a fifth of the time.
"""

from __future__ import annotations

import pickle
import select
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any, Generic, TypeVar

from irsim.errors import exit_status_text
from irsim.render.interrupts import process

END_S = 10.0
"""How long a process whose pipe has ended may take to end itself."""

Answer = TypeVar("Answer")
Answering = Callable[..., Iterable[Any]]
"""What answers to a piece of work."""


class WorkerDiedError(Exception):
    """It answers no more; its text says how it ended."""

    def __init__(self, status: int | None) -> None:
        super().__init__(exit_status_text(status))
        self.told = status == 1
        """Whether it has said why on standard error, as Python does."""


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
        self._count = self._to_come = count
        self._here: deque[Answer] = deque()

    def put(self, answer: Answer) -> bool:
        """One more has come; whether it was the last."""
        self._here.append(answer)
        self._to_come -= 1
        return self._to_come == 0

    @property
    def left(self) -> float:
        """Share of them that are yet to come."""
        return self._to_come / self._count

    def has_next(self) -> bool:
        """Whether `next` need not wait."""
        if not self._here:
            self._worker.listen()
        return bool(self._here) or self._worker.ended is not None

    def next(self) -> Answer:
        """Waits for the next one. What the worker raised instead is raised; WorkerDiedError where it died."""
        while not self._here:
            self._worker.hear()
            if self._worker.ended is not None and not self._here:
                raise self._worker.ended
        return self._here.popleft()


class Worker:
    """A process in which begin(*inherited, *given) gives what is called with each piece of work and yields its answers.

    `inherited`: what is handed to a process only while it is started. Start it while `interrupts_held`.
    """

    def __init__(
        self, context: BaseContext, begin: Callable[..., Answering], *given: Any, inherited: Sequence[Any] = ()
    ) -> None:
        self._pipe, theirs = context.Pipe()
        self._has_come = _ear(self._pipe)
        self._process = process(context, _serve, pickle.dumps((begin, given)), inherited=(theirs, inherited))
        self._asked: deque[Answers[Any]] = deque()
        self.ended: Exception | None = None
        """What it raised, or that it died, as soon as that is heard of."""
        self._process.start()
        theirs.close()  # or its end would not be heard of

    @property
    def pid(self) -> int:
        pid = self._process.pid
        assert pid is not None  # it was started
        return pid

    def left(self) -> float:
        """Pieces, and shares of them, that it has yet to do."""
        self.listen()
        return sum(answers.left for answers in self._asked)

    def give(self, count: int, *work: Any) -> Answers[Any]:
        """A piece of work to which there are so many answers. Whoever waits for them is told if it has died."""
        answers: Answers[Any] = Answers(self, count)
        self._asked.append(answers)
        with suppress(OSError):
            self._pipe.send(work)
        return answers

    def listen(self) -> None:
        """What has come so far is taken from the pipe."""
        while self._asked and self.ended is None and self._has_come():
            self.hear()

    def hear(self) -> None:
        """Waits for an answer, or its end."""
        if self.ended is not None:
            return
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join(END_S)
            self.ended = WorkerDiedError(self._process.exitcode)
            return
        if isinstance(answer, _Raised):
            self.ended = answer.error
            self.ended.__cause__ = _InWorkerError(answer.told)
        elif self._asked[0].put(answer):
            self._asked.popleft()

    def close(self) -> None:
        """It is ended, whatever it is at."""
        self._process.kill()
        self._process.join()
        self._pipe.close()
        self.ended = None  # its traceback leads here, and to all that was at hand where it was raised


def _ear(pipe: Connection) -> Callable[[], bool]:
    """Whether something has come by a pipe, or its end. Its own `poll` makes a selector, which takes 25 us."""
    if not hasattr(select, "poll"):
        return lambda: _polled(pipe)
    polling = select.poll()
    polling.register(pipe.fileno(), select.POLLIN)
    return lambda: bool(polling.poll(0))


def _polled(pipe: Connection) -> bool:
    try:
        return pipe.poll()
    except OSError:  # on Windows, of a pipe that has ended
        return True


def _serve(pipe: Connection, inherited: Sequence[Any], pickled: bytes) -> None:
    with suppress(OSError):  # nobody listens any more
        for answer in _answered(pipe, inherited, pickled):
            pipe.send(answer)


def _answered(pipe: Connection, inherited: Sequence[Any], pickled: bytes) -> Iterator[Any]:
    """Answers until nobody asks any more, or what is raised instead of one."""
    try:
        begin, given = pickle.loads(pickled)
        answering = begin(*inherited, *given)
        while (work := _asked(pipe)) is not None:
            yield from answering(*work)
    except Exception as error:
        raised = _Raised(error, traceback.format_exc())
        try:
            pickle.loads(pickle.dumps(raised))
        except Exception:
            raised = _Raised(RuntimeError(f"{type(error).__name__}: {error}"), raised.told)
        yield raised


def _asked(pipe: Connection) -> tuple[Any, ...] | None:
    try:
        work: tuple[Any, ...] = pipe.recv()
    except (EOFError, OSError):
        return None
    return work
