"""An AGC at work on a sequence of frames."""

from __future__ import annotations

from collections.abc import Callable

from irsim.camera.agc import Agc, Look, Picture
from irsim.types import Frame, Image


class Screen:
    """Shows the frames of a sequence by an AGC: any of them, in any order, each the same bit for bit.

    A frame's picture is made by looks at its predecessors, as many as the AGC remembers. They are kept
    while frames are shown in order; those that were not shown are fetched by `counts`, which gives the
    counts of a frame by its index.
    """

    def __init__(self, agc: Agc, bits: int, counts: Callable[[int], Image]) -> None:
        self._agc = agc
        self._bits = bits
        self._counts = counts
        self._looks: dict[int, Look] = {}

    def picture(self, counts: Image, index: int) -> Picture:
        """The picture of frame `index`, whose counts are given."""
        agc, bits = self._agc, self._bits
        if agc.memory == 0:
            return agc.display(counts, bits)
        kept = {**self._looks, index: agc.look(counts, bits)}  # its own: another thread may put others there
        window = range(max(0, index - agc.memory), index + 1)
        looks = self._looks = {k: kept[k] if k in kept else agc.look(self._counts(k), bits) for k in window}
        return agc.picture(counts, bits, list(looks.values()))

    def show(self, frame: Frame) -> Frame:
        """The frame of the counts as one of 8 bits."""
        return Frame(self.picture(frame.image, frame.index), frame.index, frame.time, 8)
