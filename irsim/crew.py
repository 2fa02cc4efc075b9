"""Frames of a scenario in order, rendered by several processes."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from irsim.errors import InputError, IrsimError
from irsim.interrupts import beginning, interrupts_held
from irsim.parcels import Parcel, Shared, pack, shared, unpack
from irsim.render import Renderer
from irsim.scenario import Scenario
from irsim.types import Frame, Truth

LENGTHS = (16, 8, 4, 2, 1)
"""Frames that a worker may render at a time; neighbours share the memory of noise with memory, and blocks of eight a
key frame (`irsim.backgrounds.painting.BLOCK`)."""

MOST_WAITING = 64 << 20
"""Bytes of the frames that wait, as long as a worker can render one at a time."""

BESIDE = 2
"""Chunks that wait beside those that workers have: one that is next, and one that is taken from."""

COUNT_BYTES = 2


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """A frame and its truth, and the id of the process that rendered them."""

    pid: int
    frame: Frame
    truth: Truth


def chunk_length(jobs: int, size: int) -> int:
    """Frames that each of so many workers renders at a time, of pictures of so many bytes."""
    return next((each for each in LENGTHS if (jobs + BESIDE) * each * size <= MOST_WAITING), LENGTHS[-1])


def rendered(scenario: Scenario, wanted: Sequence[int], jobs: int) -> Generator[Rendered, None, None]:
    """The wanted frames, in order, by `jobs` worker processes; a few chunks wait ahead at most.

    IrsimError where a worker dies; InputError for fewer jobs than one.
    """
    if jobs < 1:
        raise InputError(f"jobs {jobs}: allowed: 1 or more")
    columns, rows = scenario.camera.size
    size = columns * rows * COUNT_BYTES
    jobs = min(jobs, max(len(wanted), 1))
    length, at_once = chunk_length(jobs, size), jobs + BESIDE
    places = min(at_once * length, len(wanted))
    context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
    pending: deque[tuple[int, Future[tuple[int, list[Parcel]]]]] = deque()
    told = "before its first frames; allowed: what it asks for above, or fewer jobs"
    with (
        shared(min(places * size, MOST_WAITING)) as memory,
        ProcessPoolExecutor(
            jobs, mp_context=context, **beginning(_prepare, scenario, size, inherited=[memory])
        ) as pool,
    ):

        def first() -> Iterator[Rendered]:
            """What the chunk that is asked for the longest holds; each frame is copied when it is wanted."""
            nonlocal told
            begin, chunk = pending.popleft()
            pid, parcels = chunk.result()
            told = "while it rendered; allowed: the same again, or fewer jobs"
            for number, parcel in enumerate(parcels, begin):
                frame, truth = unpack(parcel, memory.part(number % places, size))
                yield Rendered(pid, frame, truth)

        try:
            for begin in range(0, len(wanted), length):
                with interrupts_held():
                    chunk = pool.submit(_render, wanted[begin : begin + length], begin % places)
                    pending.append((begin, chunk))
                if len(pending) == at_once:
                    yield from first()
            while pending:
                yield from first()
        except BrokenProcessPool:
            raise IrsimError(f"a worker process died {told}") from None
        finally:
            pool.shutdown(cancel_futures=True)


_worker: tuple[Renderer, Shared, int]


def _prepare(memory: Shared, scenario: Scenario, size: int) -> None:
    global _worker  # a pool's initializer has no other way to leave something to its tasks
    import cv2

    cv2.setNumThreads(1)
    _worker = Renderer(scenario), memory, size


def _render(wanted: Sequence[int], place: int) -> tuple[int, list[Parcel]]:
    """This process's id, and the wanted frames, whose counts lie in memory from a place on."""
    renderer, memory, size = _worker
    return os.getpid(), [
        pack(renderer.frame(index), memory.part(number, size)) for number, index in enumerate(wanted, place)
    ]
