"""Small sources and trackers for the tests of replay and bench: importable, so that workers find them."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Frame, Input, Source, TargetTruth, Truth
from irtrack.replay.replay import BLOCK_FRAMES
from irtrack.types import Estimate


@dataclass(frozen=True, eq=False)
class Strip(Source):
    """A source of 20 frames of 64x48: target 'a' moves right by 1 px a frame from (10, 20), 4x3 px."""

    name: str = "strip"
    hash: str = "5712"
    visible: tuple[float | None, ...] = (1.0,) * 20
    follow: str | None = None
    has_truth: bool = True
    size: tuple[int, int] = (64, 48)
    bits: int = 14
    rate_hz: float = 10.0

    def __len__(self) -> int:
        return len(self.visible)

    def frame(self, index: int, input: Input = "counts") -> Frame:
        image = np.full((48, 64), index, np.uint8 if input == "display" else np.uint16)
        return Frame(image, index, index / self.rate_hz, 8 if input == "display" else self.bits)

    def frames(self, input: Input = "counts", start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        return (self.frame(index, input) for index in range(len(self))[start:stop])

    def truths(self, start: int = 0, stop: int | None = None) -> Iterator[Truth]:
        if not self.has_truth:
            return
        for index in range(len(self))[start:stop]:
            center = (10.0 + index, 20.0)
            target = TargetTruth("a", center, Box(*center, 4.0, 3.0), visible=self.visible[index])
            yield Truth(index, index / self.rate_hz, (target,))


class Mute(Strip):
    """Its process dies while it gives frames."""

    def frame(self, index: int, input: Any = "counts") -> Any:
        os.kill(os.getpid(), signal.SIGKILL)


class LateMute(Mute):
    """It dies when trackers have seen a block of frames."""

    def frame(self, index: int, input: Any = "counts") -> Any:
        return super().frame(index, input) if index == BLOCK_FRAMES else Strip.frame(self, index, input)


@dataclass(frozen=True)
class Walker:
    """Says that the target moves right by `speed` px a frame, with `jitter` px of its generator's noise."""

    speed: float = 1.0
    jitter: float = 0.0
    resumable: ClassVar[bool] = True

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Box:
        return box

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        state = Box(state.cx + self.speed, state.cy, state.w, state.h)
        x, y = self.jitter * rng.standard_normal(2)
        return state, Estimate((state.cx + x, state.cy + y), (state.w, state.h), score=0.5)


@dataclass(frozen=True)
class Logger(Walker):
    """A walker that leaves a line 'pid frame' in the file `log` at each step.

    While the file `hold` exists it goes no further than `patience` lines.
    """

    log: str = ""
    hold: str = ""
    patience: int = 0

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        with Path(self.log).open("a") as file:
            file.write(f"{os.getpid()} {frame.index}\n")
        while self.hold and Path(self.hold).exists() and len(Path(self.log).read_bytes().split(b"\n")) > self.patience:
            time.sleep(0.01)
        return super().step(state, frame, rng)


@dataclass(frozen=True)
class Breaker(Walker):
    """Raises at frame `at`."""

    at: int = 5

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index == self.at:
            raise RuntimeError("the planted failure")
        return super().step(state, frame, rng)


@dataclass(frozen=True)
class Holder(Walker):
    """Has a parameter of any kind."""

    held: Any = None


@dataclass(frozen=True)
class Vandal(Walker):
    """Writes into the frame that it is shown."""

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        frame.image[:] = 0
        return super().step(state, frame, rng)


@dataclass(frozen=True)
class Eraser(Walker):
    """Makes the frame writable, and erases it."""

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        frame.image.setflags(write=True)
        frame.image[:] = 0
        object.__setattr__(frame, "index", 0)
        return super().step(state, frame, rng)


@dataclass(frozen=True)
class Reader(Walker):
    """Says that the target is as far right of x = 10 as the first pixel is bright: the path of `Strip`."""

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        return state, Estimate((10.0 + frame.image[0, 0], state.cy), (state.w, state.h))


@dataclass(frozen=True)
class Forker(Walker):
    """Copies its process at frame `at`: both copies return."""

    at: int = 5

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index == self.at:
            os.fork()
        return super().step(state, frame, rng)


@dataclass(frozen=True)
class Vague(Walker):
    """Says that the target is nowhere."""

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Any, Estimate]:
        return state, Estimate((float("nan"), 0.0), (1.0, 1.0))


def steps(log: Path) -> Counter[int]:
    """How often each frame was stepped."""
    return Counter(int(line.split()[1]) for line in log.read_text().splitlines()) if log.exists() else Counter()


@dataclass(frozen=True)
class Hanger(Walker):
    """Sleeps at frame `at`, for ever as far as a test goes."""

    at: int = 5
    seconds: float = 600.0

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index == self.at:
            time.sleep(self.seconds)
        return super().step(state, frame, rng)


class MuteError(Exception):
    """Cannot even say what it is."""

    def __str__(self) -> str:
        raise RuntimeError


RAISED = {"interrupt": KeyboardInterrupt, "exit": SystemExit, "mute": MuteError, "memory": MemoryError}


@dataclass(frozen=True)
class Raiser(Walker):
    """Raises at frame 5 what is called `what` in `RAISED`."""

    what: str = "exit"

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index == 5:
            raise RAISED[self.what]
        return super().step(state, frame, rng)


class Still:
    """A plain tracker that gives the start box for ever."""

    def start(self, frame: Any, box: Box) -> None:
        self.box = box

    def step(self, frame: Any) -> Any:
        return self.box


class Says:
    """A plain tracker that gives another answer from frame 5 on."""

    answer: Any = None

    def start(self, frame: Any, box: Box) -> None:
        self.box, self.steps = box, 0

    def step(self, frame: Any) -> Any:
        self.steps += 1
        return self.box if self.steps < 5 else self.answer


class SaysNan(Says):
    answer = (float("nan"), 20.0, 4.0, 3.0)


class SaysTwo(Says):
    answer = (12.0, 20.0)


class SaysText(Says):
    answer = "1234"


@dataclass(frozen=True)
class Closer(Walker):
    """Closes all files of its process at frame `at`: that can give no answer any more."""

    at: int = 5

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index == self.at:
            os.closerange(0, 100)
        return super().step(state, frame, rng)


@dataclass(frozen=True)
class Threader(Walker):
    """Starts a thread that goes on, and holds up the end of its process."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Box:
        threading.Thread(target=time.sleep, args=(600,)).start()
        return super().init(frame, box, rng)


@dataclass(frozen=True)
class Killer(Walker):
    """Kills its own process at frame `at`; where `once` names a file, only once: it leaves the file there."""

    at: int = 5
    once: str = ""

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index == self.at and not (self.once and Path(self.once).exists()):
            if self.once:
                Path(self.once).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().step(state, frame, rng)
