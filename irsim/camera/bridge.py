"""Processes with memory, any frame of which costs few draws."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Generic, TypeVar

State = TypeVar("State")

ANCHOR_CORRELATION = 1e-6
"""Frames whose correlation is below this are drawn independently of each other."""


class Midways(ABC, Generic[State]):
    """A Markov process of which frames between two known ones can be drawn."""

    @abstractmethod
    def between(self, before: State, after: State, index: int, distance: int) -> State:
        """A draw of frame `index` given those `distance` before and after it, addressed by index."""

    def way(
        self, index: int, ends: Mapping[int, State], kept: Mapping[int, State], finest: int = 1
    ) -> dict[int, State]:
        """The frames drawn on the way to frame `index` from the `ends`, itself or two that are a power of two apart;
        ends too, down to those `finest` apart. Each frame halves what is between the two that it lies between. What is
        `kept` is not drawn anew."""
        nodes, left = dict(ends), min(ends)
        distance = max(ends) - left
        while index not in nodes and distance > finest:
            distance //= 2
            middle = left + distance
            if middle in kept:
                nodes[middle] = kept[middle]
            else:
                nodes[middle] = self.between(nodes[left], nodes[middle + distance], middle, distance)
            if middle <= index:
                left = middle
        return nodes


class Bridge(Midways[State]):
    """A stationary Markov process whose correlation falls by exp(-decay) a frame.

    Every `period` frames stands an anchor, independent of the others. Between two anchors runs a
    bridge: frame k is drawn from its two neighbours at a distance d = the largest power of two that
    divides k, they from theirs, up to the anchors. The nodes on the way to the last frame are kept:
    in sequence a frame costs one draw on average. What is kept changes no result.
    """

    def __init__(self, decay: float) -> None:
        self.decay = decay
        self.period = 1
        while self.period * decay <= -math.log(ANCHOR_CORRELATION):
            self.period *= 2
        self._kept: dict[int, State] = {}

    @abstractmethod
    def anchor(self, index: int) -> State:
        """A draw of the stationary law, addressed by index."""

    def frame(self, index: int) -> State:
        """The process at frame `index`; the caller must not write to it."""
        return self._nodes(index, 1)[index]

    def beside(self, index: int) -> tuple[State, State]:
        """The process right before and after a frame of odd number, that is midway between them: for a period of 2 and
        more."""
        nodes = self._nodes(index, 2)
        return nodes[index - 1], nodes[index + 1]

    def _nodes(self, index: int, finest: int) -> Mapping[int, State]:
        kept = self._kept  # once: another thread may put its own there
        left = index - index % self.period
        anchors = (left,) if left == index else (left, left + self.period)
        ends = {anchor: kept[anchor] if anchor in kept else self.anchor(anchor) for anchor in anchors}
        nodes = self._kept = self.way(index, ends, kept, finest)
        return nodes
