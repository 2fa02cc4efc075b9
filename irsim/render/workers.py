"""Frames of a scenario, in order, rendered by a pool of worker processes.

Block i of consecutive frames is rendered by the worker with the number i modulo the number of workers. Each worker has
two blocks at a time: the parent process takes the frames of one while the worker renders the other. Pictures pass
through shared memory, truths through a pipe, several in a message.
"""

from __future__ import annotations

import multiprocessing
import pickle
import traceback
from collections import deque
from collections.abc import Generator, Sequence
from contextlib import ExitStack, closing, suppress
from ctypes import Array, c_uint16
from itertools import cycle
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext

import cv2
import numpy as np

from irsim.errors import IrsimError, exit_status_text
from irsim.render.frame import Renderer
from irsim.render.interrupts import interrupts_held, process
from irsim.scenario.model import Scenario
from irsim.types import Counts, Frame, Truth

BLOCKS = (64, 32, 16, 8, 4, 2, 1)
"""Possible sizes of a block, frames. Eight consecutive frames share a key frame (`irsim.backgrounds.texture`).
Correlated noise is initialised anew in each block, so that long blocks are faster."""

BLOCKS_EACH = 4
"""Least number of blocks per worker, if there are enough frames, so that all workers end at about the same time."""

QUEUED = 2
"""Number of blocks that a worker has at a time."""

BATCH = 8
"""Largest number of truths in one message."""

MEMORY = 256 << 20
"""Largest shared memory, bytes. Each worker has room for at least two pictures."""

EXIT_S = 10.0
"""Longest wait for the end of a process whose pipe is closed, s."""


def rendered(scenario: Scenario, wanted: Sequence[int], jobs: int) -> Generator[tuple[Frame, Truth], None, None]:
    """Yield (frame, truth) of the frames with the numbers `wanted`, in order, rendered by `jobs` worker processes.

    An error in a worker is raised in place of the frame that failed. IrsimError where a worker dies.
    """
    block = block_frames(jobs, scenario.camera.size, len(wanted))
    blocks = [wanted[begin : begin + block] for begin in range(0, len(wanted), block)]
    with ExitStack() as stack:
        context = multiprocessing.get_context("spawn")  # safe with threads, the same on every system
        with interrupts_held():
            workers = [stack.enter_context(closing(_Worker(context, scenario, QUEUED * block))) for _ in range(jobs)]
        for worker, each in zip(cycle(workers), blocks[: QUEUED * jobs]):
            worker.give(each)
        following = iter(blocks[QUEUED * jobs :])
        for worker, each in zip(cycle(workers), blocks):
            for _ in each:
                yield worker.next()
            if (one := next(following, None)) is not None:
                worker.give(one)


def block_frames(jobs: int, size: tuple[int, int], count: int) -> int:
    """Return the number of frames in a block for `jobs` workers, pictures of `size` (columns, rows) px, `count`
    frames."""
    most = min(
        MEMORY // (jobs * QUEUED * size[0] * size[1] * np.dtype(np.uint16).itemsize), count // (jobs * BLOCKS_EACH)
    )
    return next((each for each in BLOCKS if each <= most), BLOCKS[-1])


class _Worker:
    """Parent process's handle of a worker process that renders blocks. Create it within `interrupts_held`."""

    def __init__(self, context: BaseContext, scenario: Scenario, slots: int) -> None:
        columns, rows = scenario.camera.size
        memory = context.RawArray(c_uint16, slots * rows * columns)  # nameless: removed with its last process
        self._slots = cycle(_pictures(memory, scenario))
        self._pipe, theirs = context.Pipe()
        self._bits, self._heard = scenario.camera.bits, False
        self._answers: deque[Truth | Exception] = deque()
        self._process = process(context, _serve, scenario, inherited=(theirs, memory))
        self._process.start()
        theirs.close()  # the pipe then closes when the process ends

    def give(self, block: Sequence[int]) -> None:
        with suppress(OSError):  # a dead worker is reported by `next`
            self._pipe.send(block)

    def next(self) -> tuple[Frame, Truth]:
        """Return the next frame and its truth; raise the worker's error, or IrsimError if it died."""
        try:
            if not self._answers:
                self._answers.extend(self._pipe.recv())
            answer = self._answers.popleft()
        except (EOFError, OSError):
            raise self._death() from None
        if isinstance(answer, Exception):
            raise answer
        self._heard = True
        return Frame(next(self._slots).copy(), answer.index, answer.time, self._bits), answer

    def _death(self) -> IrsimError:
        self._process.join(EXIT_S)
        code = self._process.exitcode
        when = "while it rendered" if self._heard else "before its first frame"
        # Status 1 follows a traceback, or the hint on the guard: stderr has the reason.
        allowed = "the change named above" if code == 1 and not self._heard else "the same again"
        return IrsimError(f"a worker process died {when} ({exit_status_text(code)}); allowed: {allowed}, or fewer jobs")

    def close(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _pictures(memory: Array[c_uint16], scenario: Scenario) -> list[Counts]:
    """Return the shared memory as pictures, each (rows, cols)."""
    columns, rows = scenario.camera.size
    return list(np.frombuffer(memoryview(memory), np.uint16).reshape(-1, rows, columns))


def _serve(pipe: Connection, memory: Array[c_uint16], scenario: Scenario) -> None:
    """Render blocks in a worker process: send the truths of their frames, write the pictures to `memory`."""
    cv2.setNumThreads(1)
    slots, truths = cycle(_pictures(memory, scenario)), list[Truth]()
    with suppress(EOFError, OSError):  # the parent has closed its end
        try:
            renderer = Renderer(scenario)
            while True:
                block = pipe.recv()
                for number, index in enumerate(block, 1):
                    truths.append(renderer.frame(index, next(slots))[1])
                    if number % BATCH == 0 or number == len(block):
                        pipe.send(truths)
                        truths = []
        except Exception as error:
            pipe.send([*truths, _sendable(error)])


def _sendable(error: Exception) -> Exception:
    """Return an error that carries the worker's traceback as a note; a RuntimeError where it cannot be pickled."""
    note = f"in a worker process:\n{traceback.format_exc()}"
    error.add_note(note)
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
        error.add_note(note)
    return error
