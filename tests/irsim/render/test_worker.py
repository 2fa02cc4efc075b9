"""A worker: its answers come in order, what it raises is raised here, and its end is heard of."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest
from processes import runs, wait_until

from irsim.errors import InputError
from irsim.render.interrupts import interrupts_held
from irsim.render.worker import Worker, WorkerDiedError


def counting(inherited: str, given: str) -> Callable[[int, int], Iterator[tuple[str, str, int]]]:
    def answer(begin: int, end: int) -> Iterator[tuple[str, str, int]]:
        for number in range(begin, end):
            yield inherited, given, number

    return answer


class OddError(Exception):
    """It cannot be made again from its text alone."""

    def __init__(self, one: int, other: int) -> None:
        super().__init__(f"{one} of {other}")


def failing(what: str) -> Callable[[], Iterator[int]]:
    if what == "begin":
        raise InputError("begin: it cannot")

    def answer() -> Iterator[int]:
        yield 1
        if what == "odd":
            raise OddError(2, 3)
        if what == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if what == "ended":
            raise EOFError("of a file of its own")
        raise InputError("answer: it cannot")

    return answer


def started(
    begin: Callable[..., Callable[..., Iterator[object]]], *given: str, inherited: tuple[str, ...] = ()
) -> Worker:
    with interrupts_held():
        return Worker(multiprocessing.get_context("spawn"), begin, *given, inherited=inherited)


def test_answers_to_several_pieces_come_in_order() -> None:
    with closing(started(counting, "given", inherited=("inherited",))) as worker:
        pieces = [worker.give(end - begin, begin, end) for begin, end in [(0, 3), (3, 4), (4, 300)]]
        assert 0 < worker.left() <= 3
        last = [pieces[2].next() for _ in range(296)]  # those of the pieces before are kept meanwhile
        assert all(piece.has_next() for piece in pieces[:2])
        assert worker.left() == 0
        first = [pieces[0].next() for _ in range(3)] + [pieces[1].next()]
        assert [*first, *last] == [("inherited", "given", number) for number in range(300)]
        pid = worker.pid
    assert not runs(pid)


@pytest.mark.parametrize(
    ("what", "before", "error", "said"),
    [
        ("begin", 0, InputError, "^begin: it cannot$"),
        ("answer", 1, InputError, "^answer: it cannot$"),
        ("odd", 1, RuntimeError, "^OddError: 2 of 3$"),
        ("ended", 1, EOFError, "^of a file of its own$"),
        ("killed", 1, WorkerDiedError, "^SIGKILL$"),
    ],
)
def test_what_ends_a_worker_is_raised_where_its_answer_is_wanted(
    what: str, before: int, error: type[Exception], said: str | None
) -> None:
    with closing(started(failing, what)) as worker:
        piece = worker.give(5)
        for _ in range(before):
            assert piece.next() == 1
        with pytest.raises(error, match=said) as raised:
            piece.next()
        if error is not WorkerDiedError:
            assert "in failing" in str(raised.value.__cause__) or "in answer" in str(raised.value.__cause__)
        wait_until(lambda: not worker._process.is_alive())
        later = worker.give(1)  # who gives it something then is not told, who waits for it is
        with pytest.raises(error):
            later.next()


def test_a_worker_ends_where_signals_that_ask_for_it_are_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        worker = started(counting, "given", inherited=("inherited",))
        worker.give(1, 0, 1).next()
        worker.close()
        assert not runs(worker.pid)
    finally:
        signal.signal(signal.SIGTERM, before)
