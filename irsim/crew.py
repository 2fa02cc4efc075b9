"""Frames of a scenario in order, rendered by several processes: this one and workers beside it."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field, replace

import numpy as np

from irsim.errors import IrsimError, whole
from irsim.interrupts import beginning, interrupts_held
from irsim.lean import lean
from irsim.places import COUNT_BYTES, Shared, shared
from irsim.render import Renderer
from irsim.scenario import Scenario
from irsim.shelf import Lock
from irsim.types import Counts, Frame, Truth

LENGTHS = (32, 16, 8, 4, 2, 1)
"""Frames that a process may render at a time; neighbours share the memory of noise with memory, and blocks of eight a
key frame (`irsim.backgrounds.painting.BLOCK`)."""

MOST_WAITING = 128 << 20
"""Bytes of the frames that wait, as long as a process can render one at a time."""

SHELF = 64 << 20
"""Bytes for what processes work out for each other, taken from the machine as they are needed. At 640x512 two layers of
clouds that evolve write it full in some 1,000 frames; processes are not so far apart."""

BESIDE = 2
"""Chunks in memory that is shared beside those that workers have: one that is next, and one that is taken from."""

EACH = 2
"""Chunks that a worker may have to render, where there are places: the one that it is at, and the next."""

OWN = EACH + 1
"""Chunks that this process may have rendered before they are wanted. More than a worker has, or it would wait for those
of one that is slower than itself."""

NOTHING: Counts = np.empty((0, 0), np.uint16)
"""The picture of a frame whose picture lies elsewhere."""


@lean
@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """A frame and its truth, and the id of the process that rendered them."""

    pid: int
    frame: Frame
    truth: Truth


def chunk_length(jobs: int, size: int, count: int) -> int:
    """Frames that each of so many processes renders at a time, of `count` pictures of so many bytes."""
    most = min(MOST_WAITING // ((jobs - 1 + BESIDE + OWN) * size), count // jobs)
    return next((each for each in LENGTHS if each <= most), LENGTHS[-1])


def chunked(wanted: Sequence[int], length: int, jobs: int) -> Iterator[Sequence[int]]:
    """The wanted frames in chunks of a length, and ever shorter ones towards the end: all are to be done at once."""
    begin = 0
    while begin < len(wanted):
        share = (len(wanted) - begin) // (2 * jobs)
        end = begin + next((each for each in LENGTHS if each <= min(length, share)), LENGTHS[-1])
        yield wanted[begin:end]
        begin = end


def rendered(renderer: Renderer, wanted: Sequence[int], jobs: int) -> Generator[Rendered, None, None]:
    """The wanted frames, in order, by this process and `jobs - 1` workers; it renders while it waits for theirs. A few
    chunks wait ahead at most.

    IrsimError where a worker dies; InputError for jobs that are no whole number from 1 on.
    """
    jobs = min(whole("jobs", jobs, 1), len(wanted))
    if jobs <= 1:
        yield from (_here(renderer, index) for index in wanted)
        return
    columns, rows = renderer.scenario.camera.size
    size = columns * rows * COUNT_BYTES
    length = chunk_length(jobs, size, len(wanted))
    count = (jobs - 1 + BESIDE) * length
    chunks = deque(chunked(wanted, length, jobs))
    context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
    with (
        shared(min(count * size, MOST_WAITING)) as memory,
        shared(SHELF, at_once=False) as shelf,
        renderer.shelf.opened(shelf.bytes, lock := context.Lock()),
        ProcessPoolExecutor(
            jobs - 1,
            mp_context=context,
            **beginning(_prepare, renderer.scenario, inherited=[memory, shelf, lock]),
        ) as pool,
    ):
        crew = _Crew(renderer, chunks, pool, memory, deque(range(count)), jobs - 1)
        try:
            yield from crew.frames()
        except BrokenProcessPool:
            when = "while it rendered" if crew.heard else "before its first frames"
            allowed = "the same again" if crew.heard else "what it asks for above"
            raise IrsimError(f"a worker process died {when}; allowed: {allowed}, or fewer jobs") from None
        finally:
            pool.shutdown(cancel_futures=True)


def _here(renderer: Renderer, index: int, out: Counts | None = None) -> Rendered:
    return Rendered(os.getpid(), *renderer.frame(index, out))


@dataclass(eq=False)
class _Own:
    """A chunk of this process."""

    left: deque[int]
    done: deque[Rendered] = field(default_factory=deque)


@dataclass(frozen=True, eq=False)
class _Theirs:
    """A chunk of a worker."""

    places: Sequence[int]
    """Where its frames are put."""
    coming: Future[list[Rendered]]


class _Crew:
    """Who renders which chunk. Workers have a few each, this process takes one when it would have to wait for them."""

    def __init__(
        self,
        renderer: Renderer,
        chunks: deque[Sequence[int]],
        pool: ProcessPoolExecutor,
        memory: Shared,
        places: deque[int],
        workers: int,
    ) -> None:
        self.heard = False
        """Whether a worker has rendered any."""
        self._renderer = renderer
        self._chunks = chunks  # that nobody has
        self._pool = pool
        self._memory = memory
        self._places = places  # in it, that are free
        self._workers = workers
        self._begun: deque[_Own | _Theirs] = deque()  # in the order of frames

    def frames(self) -> Iterator[Rendered]:
        while self._chunks or self._begun:
            if not self._begun:
                self._take()
            self._hand_out()
            chunk = self._begun[0]
            yield from self._rendered(chunk) if isinstance(chunk, _Own) else self._fetched(chunk)
            self._begun.popleft()

    def _hand_out(self) -> None:
        """Workers get what there are places for, but leave as much to this process as each of them has."""
        while (
            self._chunks
            and len(self._places) >= len(self._chunks[0])
            and self._waiting() < self._workers * min(EACH, len(self._chunks))
        ):
            places = [self._places.popleft() for _ in self._chunks[0]]
            with interrupts_held():
                self._begun.append(_Theirs(places, self._pool.submit(_render, self._chunks.popleft(), places)))

    def _waiting(self) -> int:
        """Chunks that workers have yet to finish."""
        return sum(isinstance(chunk, _Theirs) and not chunk.coming.done() for chunk in self._begun)

    def _take(self) -> _Own:
        chunk = _Own(deque(self._chunks.popleft()))
        self._begun.append(chunk)
        return chunk

    def _rendered(self, chunk: _Own) -> Iterator[Rendered]:
        """What is done of it already, and the rest, each frame when it is wanted."""
        yield from chunk.done
        for index in chunk.left:
            yield _here(self._renderer, index)

    def _fetched(self, chunk: _Theirs) -> Iterator[Rendered]:
        """What a worker has rendered; each picture is copied when it is wanted."""
        while not chunk.coming.done() and self._get_ahead():
            pass
        done = chunk.coming.result()
        self.heard = True
        for each, place in zip(done, chunk.places, strict=True):
            picture = _picture(self._memory, place, self._renderer)
            fetched = each if picture is None else replace(each, frame=replace(each.frame, image=picture.copy()))
            self._places.append(place)
            yield fetched

    def _get_ahead(self) -> bool:
        """A frame more that this process will need is rendered, unless enough are."""
        own = [chunk for chunk in self._begun if isinstance(chunk, _Own)]
        chunk = next((chunk for chunk in own if chunk.left), None)
        if chunk is None and self._chunks and len(own) < OWN:
            chunk = self._take()
        if chunk is None:
            return False
        chunk.done.append(_here(self._renderer, chunk.left.popleft()))
        return True


def _picture(memory: Shared, place: int, renderer: Renderer) -> Counts | None:
    """Where a picture is put; None where it comes by the pipe."""
    columns, rows = renderer.scenario.camera.size
    return memory.picture(place, (rows, columns))


_worker: tuple[Renderer, Shared]


def _prepare(memory: Shared, shelf: Shared, lock: Lock, scenario: Scenario) -> None:
    global _worker  # a pool's initializer has no other way to leave something to its tasks
    import cv2

    cv2.setNumThreads(1)
    renderer = Renderer(scenario)
    renderer.shelf.open(shelf.bytes, lock)
    _worker = renderer, memory


def _render(wanted: Sequence[int], places: Sequence[int]) -> list[Rendered]:
    """The wanted frames, without the pictures for which there are places in the memory."""
    renderer, memory = _worker
    done = []
    for index, place in zip(wanted, places, strict=True):
        out = _picture(memory, place, renderer)
        each = _here(renderer, index, out)
        done.append(each if out is None else replace(each, frame=replace(each.frame, image=NOTHING)))
    return done
