"""The part of the noise that stays: summed up once for many frames."""

from __future__ import annotations

from collections.abc import Sequence
from operator import is_

import numpy as np

from irsim.detector.base import Moment
from irsim.types import Floats


class Sum:
    """The sum of patterns, kept as long as they are the same arrays: what is kept changes no result."""

    def __init__(self) -> None:
        self._kept: tuple[Sequence[Floats], Floats] | None = None

    def of(self, patterns: Sequence[Floats], moment: Moment) -> Floats | None:
        """(rows, cols) float32, in the order given; None where there are no patterns."""
        if not patterns:
            return None
        kept = self._kept  # once: another thread may put its own there
        if kept is not None and len(kept[0]) == len(patterns) and all(map(is_, kept[0], patterns)):
            return kept[1]
        total = np.array(np.broadcast_to(patterns[0], moment.shape), np.float32, order="C")
        for pattern in patterns[1:]:
            total += pattern
        self._kept = patterns, total
        return total
