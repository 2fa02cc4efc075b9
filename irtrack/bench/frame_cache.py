"""Frames of a source, kept while runs with other tracker seeds use them."""

from __future__ import annotations

from collections.abc import Iterable

from irsim.types import Input, Source, Truth
from irtrack.metrics import Reference
from irtrack.replay.replay import Pair

CACHE_BYTES = 64 * 2**20
"""Largest size of the kept images, bytes: 200 frames of 640 x 512 px of 8 bits. Each group reads longer sources
anew."""


class FrameCache:
    """Frames of the last source whose frames depend on no seed, so that they are read once for all tracker seeds."""

    def __init__(self) -> None:
        self._key: tuple[str, Input] | None = None
        self._pairs: list[Pair] = []
        self._references: dict[tuple[str | None, int], Reference] = {}

    def pairs(self, source: Source, input: Input) -> list[Pair] | None:
        """Return all frames of a source; None where they depend on the seed of the source, or are too many to keep.

        Exceptions raised by the source are passed on.
        """
        columns, rows = source.size
        pixel_bytes = 1 if input == "display" else 2
        if source.seed is not None or len(source) * columns * rows * pixel_bytes > CACHE_BYTES:
            return None
        if self._key != (source.hash, input):
            self._key, self._pairs, self._references = None, [], {}  # frees the old frames before the new ones are read
            self._pairs = list(source.pairs(input=input))
            self._key = source.hash, input
        return self._pairs

    def reference(self, target: str | None, start: int) -> Reference:
        """Return the truth of a target from frame `start` on."""
        key = target, start
        if key not in self._references:
            self._references[key] = Reference.of(truths_of(self._pairs)[start:], target)
        return self._references[key]


def truths_of(pairs: Iterable[Pair]) -> list[Truth]:
    return [truth for _, truth in pairs if truth is not None]
