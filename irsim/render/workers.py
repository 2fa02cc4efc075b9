"""Frames of a scenario in order, rendered by several processes: this one and workers beside it."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import partial
from operator import itemgetter

import numpy as np

from irsim.errors import IrsimError, whole
from irsim.render.balance import Balance
from irsim.render.division import DIVIDED, LONG, WHOLE, Contest, Picture, Trial, Way
from irsim.render.frame import Renderer
from irsim.render.interrupts import interrupts_held
from irsim.render.shared_cache import Lock
from irsim.render.shared_memory import Shared, shared
from irsim.render.worker import Answers, Worker, WorkerDiedError
from irsim.scenario.model import Scenario
from irsim.types import Frame, Truth

LENGTHS = (64, 32, 16, 8, 4, 2, 1)
"""Frames that a process may be given at a time; blocks of eight share a key frame (`irsim.backgrounds.texture`)."""

MOST_WAITING = 256 << 20
"""Bytes of the frames that wait, as long as a process can render one at a time."""

SHELF = 64 << 20
"""Bytes for what processes work out for each other, taken from the machine as they are needed. At 640x512 two layers of
clouds that evolve write it full in some 1,000 frames; processes are not so far apart."""

BESIDE = 2
"""Chunks in memory that is shared beside those that workers have: one that is next, and one that is taken from."""

EACH = 2
"""Chunks that a worker may have to work on, where there are places: the one that it is at, and the next."""

OWN = EACH + 1
"""Chunks that this process may have begun before they are wanted. More than a worker has, or it would wait for those
of one that is slower than itself."""

Half = tuple[Picture | None, Truth]
"""What a worker sends: the picture where there is no place for it, and the truth."""


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """A frame and its truth, and the id of the process that rendered them, or the light of their scene."""

    pid: int
    frame: Frame
    truth: Truth


def chunk_length(way: Way, jobs: int, size: tuple[int, int], count: int) -> int:
    """Frames that each of so many processes is given at a time, of `count` pictures of a size (columns, rows)."""
    most = MOST_WAITING // ((jobs - 1 + BESIDE + OWN) * _bytes(way, size))
    return next((each for each in LENGTHS if each <= min(most, way.length, count // jobs)), LENGTHS[-1])


def _bytes(way: Way, size: tuple[int, int]) -> int:
    return size[0] * size[1] * np.dtype(way.dtype).itemsize


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
        yield from (Rendered(os.getpid(), *renderer.frame(index)) for index in wanted)
        return
    size = renderer.scenario.camera.size
    lengths = {way: chunk_length(way, jobs, size, len(wanted)) for way in (WHOLE, DIVIDED)}
    # Chunks that are shorter than they should be would wait for each other.
    undecided = jobs == 2 and len(wanted) >= LONG and renderer.divides and lengths[DIVIDED] == DIVIDED.length
    places = jobs - 1 + BESIDE
    possible = (WHOLE, DIVIDED) if undecided else (WHOLE,)
    room = max(places * lengths[way] * _bytes(way, size) for way in possible)
    with ExitStack() as ends:
        memory = ends.enter_context(shared(min(room, MOST_WAITING)))
        workers = _workers(jobs - 1, renderer, memory, ends)
        trial = Trial(renderer)
        for frame, truth in trial.frames(wanted) if undecided else ():
            yield Rendered(os.getpid(), frame, truth)
        crew = _Crew(renderer, trial.balance(), workers, memory)
        left = wanted[trial.count :]
        contest = Contest(trial.way(), len(left))
        try:
            while left:
                way, count = contest.next(len(left))
                chunks = deque(chunked(left[:count], lengths[way], jobs))
                yield from contest.timed(crew.frames(way, chunks, deque(range(places * lengths[way]))))
                left = left[count:]
        except WorkerDiedError as died:
            when = "while it rendered" if crew.heard else "before its first frames"
            allowed = "what it asks for above" if died.told and not crew.heard else "the same again"
            raise IrsimError(f"a worker process died {when} ({died}); allowed: {allowed}, or fewer jobs") from None


def _workers(count: int, renderer: Renderer, memory: Shared, ends: ExitStack) -> list[Worker]:
    """They are closed with `ends`, before the memory that they share."""
    context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
    shelf = ends.enter_context(shared(SHELF, at_once=False))
    ends.enter_context(renderer.shelf.opened(shelf.bytes, lock := context.Lock()))
    with interrupts_held():
        return [
            ends.enter_context(closing(Worker(context, _begin, renderer.scenario, inherited=[memory, shelf, lock])))
            for _ in range(count)
        ]


@dataclass(eq=False)
class _Own:
    """A chunk of this process."""

    left: deque[int]
    begun: deque[tuple[Picture, Truth]] = field(default_factory=deque)
    failed: bool = False
    """The first that is left cannot be rendered."""


@dataclass(frozen=True, eq=False)
class _Theirs:
    """A chunk of a worker."""

    places: Sequence[int]
    """Where its pictures are put."""
    steps: Sequence[int]
    """Of the detector, for each frame, that are the worker's, where a frame is divided."""
    pid: int
    coming: Answers[list[Half]]
    here: deque[Half] = field(default_factory=deque)


class _Crew:
    """Who works on which chunk. Workers have a few each, this process takes one when it would have to wait for them."""

    def __init__(self, renderer: Renderer, balance: Balance, workers: Sequence[Worker], memory: Shared) -> None:
        self.heard = False
        """Whether a worker has done any."""
        self._renderer = renderer
        self._way: Way = WHOLE
        self._balance = balance
        self._chunks: deque[Sequence[int]] = deque()  # that nobody has
        self._workers = workers
        self._memory = memory
        self._places: deque[int] = deque()  # in it, that are free
        self._begun: deque[_Own | _Theirs] = deque()  # in the order of frames

    def frames(self, way: Way, chunks: deque[Sequence[int]], places: deque[int]) -> Iterator[Rendered]:
        """Those of chunks that nobody has, by a way; `places` in memory are free."""
        self._way, self._chunks, self._places = way, chunks, places
        while self._chunks or self._begun:
            if not self._begun:
                self._take()
            chunk = self._begun[0]
            self._hand_out()
            done = self._rendered(chunk) if isinstance(chunk, _Own) else self._fetched(chunk)
            for number, each in enumerate(done, 1):
                if number % self._way.asked == 0:
                    self._hand_out()
                yield each
            self._begun.popleft()

    def _hand_out(self) -> None:
        """Workers get what there are places for, but leave as much to this process as each of them has."""
        while self._chunks and len(self._places) >= len(self._chunks[0]):
            left, worker = min(((each.left(), each) for each in self._workers), key=itemgetter(0))
            if left > min(EACH, len(self._chunks)) - 1:
                return
            wanted = self._chunks.popleft()
            places = [self._places.popleft() for _ in wanted]
            self._balance.heed(left)
            steps = self._balance.steps(len(wanted))
            coming = worker.give(len(_messages(self._way, wanted)), self._way, wanted, places, steps)
            self._begun.append(_Theirs(places, steps, worker.pid, coming))

    def _take(self) -> _Own:
        chunk = _Own(deque(self._chunks.popleft()))
        self._begun.append(chunk)
        return chunk

    def _rendered(self, chunk: _Own) -> Iterator[Rendered]:
        """What is begun of it already, and the rest, each frame when it is wanted."""
        while chunk.begun or chunk.left:
            picture, truth = (
                chunk.begun.popleft() if chunk.begun else self._way.begun(self._renderer, chunk.left.popleft(), 0)
            )
            yield Rendered(os.getpid(), self._way.ended(self._renderer, picture, truth, 0, lent=False), truth)

    def _fetched(self, chunk: _Theirs) -> Iterator[Rendered]:
        """What a worker has done, each as soon as it is there and wanted."""
        for place, steps in zip(chunk.places, chunk.steps, strict=True):
            if not chunk.here:
                while not chunk.coming.has_next() and self._get_ahead():
                    self._hand_out()
                chunk.here.extend(chunk.coming.next())
                self.heard = True
            sent, truth = chunk.here.popleft()
            picture = _picture(self._memory, place, self._renderer, self._way) if sent is None else sent
            assert picture is not None  # it was sent, or there is a place for it
            frame = self._way.ended(self._renderer, picture, truth, steps, lent=sent is None)
            self._places.append(place)
            yield Rendered(chunk.pid, frame, truth)

    def _get_ahead(self) -> bool:
        """A frame more that this process will need is begun, unless enough are."""
        own = [chunk for chunk in self._begun if isinstance(chunk, _Own)]
        chunk = next((chunk for chunk in own if chunk.left), None)
        if chunk is None and self._chunks and len(own) < OWN:
            chunk = self._take()
        if chunk is None or chunk.failed:
            return False
        index = chunk.left.popleft()
        try:
            columns, rows = self._renderer.scenario.camera.size
            room = np.empty((rows, columns), self._way.dtype)  # given, so that counts go past the caches
            chunk.begun.append(self._way.begun(self._renderer, index, 0, room))
        except Exception:  # raised again when it is wanted, after the frames before it
            chunk.left.appendleft(index)
            chunk.failed = True
        return not chunk.failed


def _picture(memory: Shared, place: int, renderer: Renderer, way: Way) -> Picture | None:
    """Where a picture is put; None where it comes by the pipe."""
    columns, rows = renderer.scenario.camera.size
    return memory.picture(place, (rows, columns), way.dtype)


def _begin(memory: Shared, shelf: Shared, lock: Lock, scenario: Scenario) -> Callable[..., Iterator[list[Half]]]:
    import cv2

    cv2.setNumThreads(1)
    renderer = Renderer(scenario)
    renderer.shelf.open(shelf.bytes, lock)
    return partial(_halves, renderer, memory)


def _messages(way: Way, wanted: Sequence[int]) -> list[slice]:
    """The frames that a worker tells of at a time."""
    return [slice(begin, begin + way.told) for begin in range(0, len(wanted), way.told)]


def _halves(
    renderer: Renderer, memory: Shared, way: Way, wanted: Sequence[int], places: Sequence[int], steps: Sequence[int]
) -> Iterator[list[Half]]:
    for these in _messages(way, wanted):
        done: list[Half] = []
        try:
            for index, place, taken in zip(wanted[these], places[these], steps[these], strict=True):
                out = _picture(memory, place, renderer, way)
                picture, truth = way.begun(renderer, index, taken, out)
                done.append((picture if out is None else None, truth))
        except Exception:
            if done:  # before it
                yield done
            raise
        yield done
