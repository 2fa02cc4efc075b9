"""How the work on frames is divided between this process, which gives them away in order, and its workers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from time import perf_counter
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from irsim.render import Renderer
from irsim.types import Frame, Truth

Picture = npt.NDArray[Any]
"""(rows, cols), of the dtype of a `Way`."""

TRIED = 32
"""Frames by which two processes find out how to divide the work, while the worker starts; the first paints, and does
not count. As many as a chunk holds at most: what frames share, they share in blocks that begin at multiples of it."""

HERE = 0.33, 0.55
"""Least and greatest share of the time of a frame that is left to this process when work is divided. With more the
worker would wait for it. With less it would have scenes to work out as well, where a worker goes on faster with whole
frames; between the two those cost a tenth more: each process has noise with memory of its own, and what two of them
read and write for a frame does not fit into the cache that cores share."""


@dataclass(frozen=True)
class Way(ABC):
    """What workers do of a frame (`begun`), and what this process makes of it (`ended`)."""

    length: ClassVar[int]
    """Frames that a worker is given at a time."""
    told: ClassVar[int]
    """Frames that it tells of at a time: a message takes 50 us."""
    dtype: ClassVar[type[np.uint16] | type[np.float32]]
    """Of the pictures (rows, cols) between the two."""

    @abstractmethod
    def begun(self, renderer: Renderer, index: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        """The picture of a frame, in `out` where it is given, and its truth."""

    @abstractmethod
    def ended(self, renderer: Renderer, picture: Picture, truth: Truth, lent: bool) -> Frame:
        """The frame, in memory of its own. A `lent` picture is not written to."""


class Whole(Way):
    """Workers render frames, many at a time: noise with memory begins anew with each chunk."""

    length = told = 32
    dtype = np.uint16

    def begun(self, renderer: Renderer, index: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        frame, truth = renderer.frame(index, out)
        return frame.image, truth

    def ended(self, renderer: Renderer, picture: Picture, truth: Truth, lent: bool) -> Frame:
        return Frame(picture.copy() if lent else picture, truth.index, truth.time, renderer.scenario.camera.bits)


class Divided(Way):
    """Workers work out the light of scenes, this process what the detector makes of it."""

    length = 8
    told = 2
    dtype = np.float32

    def begun(self, renderer: Renderer, index: int, out: Picture | None = None) -> tuple[Picture, Truth]:
        return renderer.scene(index, out)

    def ended(self, renderer: Renderer, picture: Picture, truth: Truth, lent: bool) -> Frame:
        return renderer.developed(picture, truth, spent=not lent)


WHOLE: Way = Whole()
DIVIDED: Way = Divided()


class Trial:
    """Frames rendered here, by which is found how this process and one worker divide the others."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self._times: list[tuple[float, float, float]] = []
        """Of each frame: when it was begun, when its scene was there, and when it was."""

    def frame(self, index: int) -> tuple[Frame, Truth]:
        if not self._renderer.divides:
            return self._renderer.frame(index)
        begin = perf_counter()
        light, truth = self._renderer.scene(index)
        lit = perf_counter()
        frame = self._renderer.developed(light, truth, spent=True)
        self._times.append((begin, lit, perf_counter()))
        return frame, truth

    def way(self) -> Way:
        """The one that is faster. What is done with frames where they are taken is for this process alone, too."""
        if len(self._times) < 2:
            return WHOLE
        begins, lits, ends = np.array([*self._times, 3 * (perf_counter(),)]).T
        scene, detector, taken = (
            float(np.min(times[1:])) for times in ((lits - begins)[:-1], (ends - lits)[:-1], begins[1:] - ends[:-1])
        )
        here = (detector + taken) / (scene + detector + taken)
        return DIVIDED if HERE[0] <= here <= HERE[1] else WHOLE
