"""How the work on frames is divided between this process, which gives them away in order, and its workers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from irsim.backgrounds.texture import BLOCK
from irsim.render.balance import Balance
from irsim.render.frame import Renderer
from irsim.types import Frame, Truth

Given = TypeVar("Given")

Picture = npt.NDArray[Any]
"""(rows, cols), of the dtype of a `Way`."""

TRIED = 32
"""Frames by which two processes find out how to divide the work; the first paints, and does not count. What frames
share, they share in blocks that begin at multiples of so many, as chunks do after them."""

PHASE = 768
"""Frames by which each way shows how fast it is where the work may be divided: which is faster is a matter of the
machine. Two processes that render whole frames read and write more than caches that they share may hold; where these
are large, or not shared, neither slows down the other, as one does that waits for what the other has begun."""

TIMED = slice(256, 640)
"""Of these, those whose time counts: others before them are begun at leisure, those after them towards an end. Whole
chunks of both processes, in turns."""

BETTER = 0.95
"""Greatest share of the time of whole frames in which divided ones are to be had where they are preferred: by less,
one time differs from the next."""

LONG = 4 * PHASE
"""Frames from which on it is found out; fewer are rendered whole, from the first one on by both."""

TRIED_S = 1.0
"""Time after which so many are not waited for: the worker has started. Those begun of a block that shares a key frame
(`BLOCK`) are."""

SCENE = 0.67
"""Greatest share of a frame's time that its scene may take when work is divided. From a half on a worker has nothing
but scenes, and this process some of them too; with more than this a worker goes on faster with whole frames. Between
the two those cost a tenth more: each process has noise with memory of its own, and what two of them read and write for
a frame does not fit into the cache that cores share."""

LEFT = 0.55
"""Greatest share that may be left to this process when a worker takes all the steps it can; with more, those it cannot
would make it wait, and whole frames leave less."""


class Way(ABC):
    """What workers do of a frame (`begun`), and what this process makes of it (`ended`).

    `steps`: how many of the detector's are for workers where a frame is divided.
    """

    length: ClassVar[int]
    """Frames that a worker is given at a time."""
    told: ClassVar[int]
    """Frames that it tells of at a time: a message takes 50 us."""
    asked: ClassVar[int]
    """Frames that are taken before it is asked again whether it has enough to do, which takes 12 us."""
    dtype: ClassVar[type[np.uint16] | type[np.float32]]
    """Of the pictures (rows, cols) between the two."""

    @abstractmethod
    def begun(self, renderer: Renderer, index: int, steps: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        """The picture of a frame, in `out` where it is given, and its truth."""

    @abstractmethod
    def ended(self, renderer: Renderer, picture: Picture, truth: Truth, steps: int, lent: bool) -> Frame:
        """The frame, in memory of its own. A `lent` picture is not written to."""


class Whole(Way):
    """Workers render frames, many at a time: noise with memory begins anew with each chunk."""

    length = 64
    told = 32
    asked = 8
    dtype = np.uint16

    def begun(self, renderer: Renderer, index: int, steps: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        frame, truth = renderer.frame(index, out)
        return frame.image, truth

    def ended(self, renderer: Renderer, picture: Picture, truth: Truth, steps: int, lent: bool) -> Frame:
        return Frame(picture.copy() if lent else picture, truth.index, truth.time, renderer.scenario.camera.bits)


class Divided(Way):
    """Workers work out the light of scenes, and how the detector's answer begins, this process the rest of it."""

    length = BLOCK
    told = 2
    asked = 1
    dtype = np.float32

    def begun(self, renderer: Renderer, index: int, steps: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        light, truth = renderer.scene(index, out)
        return renderer.stepped(light, index, 0, steps), truth

    def ended(self, renderer: Renderer, picture: Picture, truth: Truth, steps: int, lent: bool) -> Frame:
        return renderer.developed(picture, truth, spent=not lent, steps=steps)


WHOLE: Way = Whole()
DIVIDED: Way = Divided()


class Trial:
    """Frames rendered here, by which is found how this process and one worker divide the others."""

    def __init__(self, renderer: Renderer) -> None:
        self.count = 0
        """How many there were."""
        self._renderer = renderer
        self._times: list[list[float]] = []
        """For the scene, each step of the detector that a worker may take, the rest and what was done with the frame,
        s, of those that do not show an earlier picture."""

    def frames(self, wanted: Sequence[int]) -> Iterator[tuple[Frame, Truth]]:
        """Some of those that are wanted, the first ones."""
        first = perf_counter()
        for index in wanted[:TRIED]:
            times = [perf_counter()]
            picture, truth = self._renderer.scene(index)
            for step in range(self._renderer.steps):
                times.append(perf_counter())
                picture = self._renderer.stepped(picture, index, step, step + 1)
            times.append(perf_counter())
            frame = self._renderer.developed(picture, truth, spent=True, steps=self._renderer.steps)
            times.append(perf_counter())
            yield frame, truth
            times.append(perf_counter())
            self.count += 1
            if self._renderer.sensor.shown(index) == index:
                self._times.append(np.diff(times).tolist())
            if self.count % BLOCK == 0 and times[-1] - first > TRIED_S:
                return

    def way(self) -> Way:
        """The one that is faster. What is done with frames where they are taken is for this process alone, too."""
        shares = self._shares()
        return DIVIDED if shares and shares[0] <= SCENE and sum(shares[-2:]) <= LEFT else WHOLE

    def balance(self) -> Balance:
        """How the detector's steps are dealt out; whole frames have all of them, whatever it says."""
        scene, *steps = self._shares()[:-2] or (1.0,)
        return Balance(scene, steps)

    def _shares(self) -> list[float]:
        """Of a frame's time, those that `_times` has; none where nothing was timed."""
        later = self._times[BLOCK:] or self._times[1:]
        if not later:
            return []
        # The quickest block: others are slower for what else the machine does. Key frames count in each.
        blocks = [np.mean(later[begin : begin + BLOCK], axis=0) for begin in range(0, len(later), BLOCK)]
        least = np.min(blocks, axis=0)
        shares: list[float] = (least / least.sum()).tolist()
        return shares


class Contest:
    """Which way two processes go on, found out by trying both where they may divide the work."""

    def __init__(self, way: Way, frames: int) -> None:
        """way, the one that a trial says; frames, how many there are to render."""
        self._way = way
        self._tries = [WHOLE, DIVIDED] if way is DIVIDED and frames > 2 * PHASE else []
        self._times: list[float] = []

    def next(self, left: int) -> tuple[Way, int]:
        """The way for the next frames, and for how many of those that are left."""
        tried = len(self._times)
        if tried < len(self._tries):
            return self._tries[tried], PHASE
        if self._times:
            whole, divided = self._times
            return (DIVIDED if divided <= BETTER * whole else WHOLE), left
        return self._way, left

    def timed(self, frames: Iterator[Given]) -> Iterator[Given]:
        """The frames themselves, while the time that they take is noted for as long as this matters."""
        tried, begin = len(self._times), 0.0
        for number, frame in enumerate(frames):
            if tried < len(self._tries) and number == TIMED.start:
                begin = perf_counter()
            elif tried < len(self._tries) and number == TIMED.stop:
                self._times.append(perf_counter() - begin)
            yield frame
