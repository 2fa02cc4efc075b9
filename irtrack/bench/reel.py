"""The frames that a worker has just read, kept for the next cells that look at them."""

from __future__ import annotations

from collections.abc import Sequence

from irsim.types import Input, Source
from irtrack.metrics import Reference
from irtrack.replay.replay import Pair

MOST_BYTES = 64 * 2**20
"""Of pictures that are kept: 200 frames of 640 x 512 as 8 bits. Of longer sources each cell reads its own."""


class Reel:
    """All frames of a source in order, and what they are measured by."""

    def __init__(self, pairs: Sequence[Pair]) -> None:
        self.pairs = pairs
        self.truths = [truth for _, truth in pairs if truth is not None]
        self._references: dict[tuple[str | None, int], Reference] = {}

    def reference(self, target: str | None, start: int) -> Reference:
        """The truth of a target from frame `start` on."""
        key = target, start
        if key not in self._references:
            self._references[key] = Reference.of(self.truths[start:], target)
        return self._references[key]


class Reels:
    """The reel of the source that was wanted last, where no seed changes it: read once for all tracker seeds."""

    def __init__(self) -> None:
        self._key: tuple[str, Input] | None = None
        self._reel = Reel(())

    def of(self, source: Source, input: Input) -> Reel | None:
        """The reel of a source; None where the next cell will want other frames, or these are too many to keep.

        What reading the source raises is passed on.
        """
        columns, rows = source.size
        pixel_bytes = 1 if input == "display" else 2
        if source.seed is not None or len(source) * columns * rows * pixel_bytes > MOST_BYTES:
            return None
        key = source.hash, input
        if key != self._key:
            self._key, self._reel = None, Reel(())  # the old one goes before the new one comes
            self._reel = Reel(list(source.pairs(input=input)))
            self._key = key
        return self._reel
