"""The things of frames, drawn a few frames ahead where frames are asked for in order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from irsim.compose import Piece
from irsim.errors import IrsimError

TOGETHER = 8
"""Frames whose things are drawn one after the other: all that it takes stays in the processor's caches meanwhile, where
a picture would leave nothing of it. A power of two, as are chunks of frames (`irsim.crew`)."""

MOST_PX = 1 << 16
"""Pixels of sprites from which on no more frames are drawn ahead: 1.5 MB."""


class Ahead:
    """What `draw` makes of each of `count` frames. What is kept changes no result."""

    def __init__(self, draw: Callable[[int], Iterable[Piece]], count: int) -> None:
        self._draw = draw
        self._count = count
        self._kept: Mapping[int, Sequence[Piece]] = {}

    def pieces(self, index: int) -> Sequence[Piece]:
        """Those of a frame, only to be read."""
        kept = self._kept  # once: another thread may put its own there
        if index not in kept:
            end = index - index % TOGETHER + TOGETHER if index - 1 in kept else index + 1
            kept = self._kept = self._drawn(index, min(end, self._count))
        return kept[index]

    def _drawn(self, begin: int, end: int) -> Mapping[int, Sequence[Piece]]:
        found = {begin: list(self._draw(begin))}
        pixels = _pixels(found[begin])
        for index in range(begin + 1, end):
            if pixels * (index + 1 - begin) / (index - begin) > MOST_PX:
                break
            try:
                found[index] = list(self._draw(index))
            except IrsimError:  # told when that frame is asked for
                break
            pixels += _pixels(found[index])
        return found


def _pixels(pieces: Iterable[Piece]) -> int:
    return sum(piece.sprite.alpha.size for piece in pieces)
