"""The part of the noise that stays: summed up once for many frames."""

from __future__ import annotations

from collections.abc import Sequence
from operator import is_
from typing import NamedTuple

import numpy as np

from irsim.detector.base import Moment
from irsim.types import Floats


class _Kept(NamedTuple):
    patterns: Sequence[Floats]
    before: Floats
    total: Floats


class Sum:
    """The sum of patterns, kept as long as they are the same arrays, and that of all but the last, which is the one to
    change: what is kept changes no result."""

    def __init__(self) -> None:
        self._kept: _Kept | None = None

    def of(self, patterns: Sequence[Floats], moment: Moment) -> Floats | None:
        """(rows, cols) float32, in the order given; None where there are no patterns."""
        if not patterns:
            return None
        kept = self._kept  # once: another thread may put its own there
        *first, last = patterns
        if kept is None or kept.total.shape != moment.shape or not _same(kept.patterns[:-1], first):
            before = np.zeros(moment.shape, np.float32)
            for pattern in first:
                before += pattern
        elif kept.patterns[-1] is last:
            return kept.total
        else:
            before = kept.before
        total = np.add(before, last, out=np.empty_like(before), casting="same_kind")
        self._kept = _Kept(patterns, before, total)
        return total


def _same(some: Sequence[Floats], others: Sequence[Floats]) -> bool:
    return len(some) == len(others) and all(map(is_, some, others))
