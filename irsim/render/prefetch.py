"""The things of frames, drawn a few frames ahead where frames are asked for in order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from irsim.render.composite import Piece

TOGETHER = 8
"""Frames at most whose things are drawn one after the other: all that it takes stays in the processor's caches
meanwhile, where a picture would leave nothing of it."""

MOST_PX = 1 << 16
"""Pixels of sprites from which on no more frames are drawn ahead, and none are kept: 1.5 MB."""


@dataclass(frozen=True, slots=True)
class _Run:
    """Frames asked for in order, from `begin` on: those before `end` are drawn, some of them kept."""

    begin: int
    end: int
    kept: Mapping[int, Sequence[Piece]] = field(default_factory=dict)


class Ahead:
    """What `draw` makes of each of `count` frames. What is kept changes no result.

    As many frames are drawn together as were asked for in order before, so that short runs draw few in vain.
    """

    def __init__(self, draw: Callable[[int], Iterable[Piece]], count: int) -> None:
        self._draw = draw
        self._count = count
        self._run = _Run(0, 0)

    def pieces(self, index: int) -> Sequence[Piece]:
        """Those of a frame, only to be read."""
        run = self._run  # once: another thread may put its own there
        if index in run.kept:
            return run.kept[index]
        begin = run.begin if index == run.end else index
        together = min(index - begin, TOGETHER) or 1
        found = self._drawn(index, min(index + together, self._count))
        small = sum(map(_pixels, found)) <= MOST_PX
        self._run = _Run(begin, index + len(found), dict(enumerate(found, index)) if small else {})
        return found[0]

    def _drawn(self, begin: int, end: int) -> list[Sequence[Piece]]:
        """Those of the frames from `begin` on before `end`, or of fewer."""
        found: list[Sequence[Piece]] = [list(self._draw(begin))]
        pixels = _pixels(found[0])
        for index in range(begin + 1, end):
            if pixels * (len(found) + 1) > MOST_PX * len(found):
                break
            try:
                found.append(list(self._draw(index)))
            except Exception:  # whatever it is, it is told when that frame is asked for
                break
            pixels += _pixels(found[-1])
        return found


def _pixels(pieces: Iterable[Piece]) -> int:
    """Of all their sprites; those of each instant, too, where the exposure takes time."""
    sprites = [piece.sprite for piece in pieces]
    meanwhile = sum(sprite.samples.alpha.size for sprite in sprites if sprite.samples is not None)
    return sum(sprite.alpha.size for sprite in sprites) + meanwhile
