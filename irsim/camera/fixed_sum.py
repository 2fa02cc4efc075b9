"""The parts of the noise that stay: put together once for many frames."""

from __future__ import annotations

from collections.abc import Sequence
from operator import is_
from typing import NamedTuple

import numpy as np

from irsim.camera.int16_image import Words, parts, words
from irsim.camera.noise_base import FrameContext
from irsim.types import Floats

FINE = 0.01
"""Units of a pattern in NETD up to which rounding to them, a standard deviation of 0.003, is too little to matter."""


class _Kept(NamedTuple):
    patterns: Sequence[Floats]
    before: Floats
    total: Sequence[Words]


class Sum:
    """The sum of patterns, kept as long as they are the same arrays, and that of all but the last, which is the one to
    change: what is kept changes no result."""

    def __init__(self) -> None:
        self._kept: _Kept | None = None

    def of(self, patterns: Sequence[Floats], frame_context: FrameContext) -> Sequence[Words]:
        """Pictures (rows, cols) whose sum it is, one or two; none where there are no patterns."""
        if not patterns:
            return ()
        kept = self._kept  # once: another thread may put its own there
        *first, last = patterns
        if kept is None or kept.before.shape != frame_context.shape or not _same(kept.patterns[:-1], first):
            before = np.zeros(frame_context.shape, np.float32)
            for pattern in first:
                before += pattern
        elif kept.patterns[-1] is last:
            return kept.total
        else:
            before = kept.before
        total = parts(np.add(before, last, out=np.empty_like(before), casting="same_kind"), FINE)
        self._kept = _Kept(patterns, before, total)
        return total


class Product:
    """What the gains of several noises are together, kept as long as they are the same arrays."""

    def __init__(self) -> None:
        self._kept: tuple[Sequence[Floats], Words] | None = None

    def of(self, gains: Sequence[Floats]) -> Words:
        """(rows, cols): by what share each pixel answers more to light, of one gain (rows, cols) float32 or more."""
        kept = self._kept  # once: another thread may put its own there
        if kept is None or not _same(kept[0], gains):
            first, *others = gains
            for other in others:
                first = (1 + first) * (1 + other) - np.float32(1)
            kept = self._kept = gains, words(first)
        return kept[1]


def _same(some: Sequence[Floats], others: Sequence[Floats]) -> bool:
    return len(some) == len(others) and all(map(is_, some, others))
