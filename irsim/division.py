"""How the work on frames is divided between this process, which gives them away in order, and its workers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from irsim.backgrounds.painting import BLOCK
from irsim.render import Renderer
from irsim.types import Frame, Truth

Picture = npt.NDArray[Any]
"""(rows, cols), of the dtype of a `Way`."""

TRIED = 32
"""Frames by which two processes find out how to divide the work; the first paints, and does not count. As many as a
chunk holds at most: what frames share, they share in blocks that begin at multiples of it."""

LONG = 4 * TRIED
"""Frames from which on it is found out; fewer are rendered whole, from the first one on by both."""

TRIED_S = 1.0
"""Time after which so many are not waited for: the worker has started. Those begun of a block that shares a key frame
(`BLOCK`) are."""

SCENE = 0.67
"""Greatest share of a frame's time that its scene may take when work is divided. With more this process would have
scenes to work out as well, where a worker goes on faster with whole frames; between the two those cost a tenth more:
each process has noise with memory of its own, and what two of them read and write for a frame does not fit into the
cache that cores share."""

HERE = 0.55
"""Greatest share that this process may be left with, whatever steps a worker takes; with more the worker would wait."""


class Way(ABC):
    """What workers do of a frame (`begun`), and what this process makes of it (`ended`).

    `steps`: how many of those of the detector are for workers, where they are not all.
    """

    length: ClassVar[int]
    """Frames that a worker is given at a time."""
    told: ClassVar[int]
    """Frames that it tells of at a time: a message takes 50 us."""
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

    length = told = 32
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
    dtype = np.float32

    def begun(self, renderer: Renderer, index: int, steps: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        light, truth = renderer.scene(index, out)
        return renderer.stepped(light, index, steps), truth

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
        self._times: list[tuple[float, float, float, float]] = []
        """For the scene, the steps of the detector that others may take, the rest and what was done with the frame, s,
        of those that do not show an earlier picture."""

    def frames(self, wanted: Sequence[int]) -> Iterator[tuple[Frame, Truth]]:
        """Some of those that are wanted, the first ones."""
        first = perf_counter()
        for index in wanted[:TRIED]:
            begin = perf_counter()
            light, truth = self._renderer.scene(index)
            lit = perf_counter()
            signal = self._renderer.stepped(light, index, self._renderer.steps)
            read = perf_counter()
            frame = self._renderer.developed(signal, truth, spent=True, steps=self._renderer.steps)
            end = perf_counter()
            yield frame, truth
            taken = perf_counter()
            self.count += 1
            if self._renderer.sensor.shown(index) == index:
                self._times.append((lit - begin, read - lit, end - read, taken - end))
            if self.count % BLOCK == 0 and taken - first > TRIED_S:
                return

    def way(self) -> Way:
        """The one that is faster. What is done with frames where they are taken is for this process alone, too."""
        later = self._times[BLOCK:] or self._times[1:]
        if not later:
            return WHOLE
        # The quickest block: others are slower for what else the machine does. Key frames count in each.
        blocks = [np.mean(later[begin : begin + BLOCK], axis=0) for begin in range(0, len(later), BLOCK)]
        scene, steps, rest, taken = np.min(blocks, axis=0).tolist()
        frame = scene + steps + rest + taken
        return DIVIDED if scene <= SCENE * frame and rest + taken <= HERE * frame else WHOLE
