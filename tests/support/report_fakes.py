"""A tracker for the tests of the report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from irsim.types import Box, Frame
from irtrack.types import Estimate


@dataclass(frozen=True)
class Still:
    """Says for ever that the target is where it was; raises at a frame where told to."""

    resumable: ClassVar[bool] = True
    raise_at: int = 1_000_000
    text: str = "a fault <planted> here"

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Box:
        return box

    def step(self, state: Box, frame: Frame, rng: np.random.Generator) -> tuple[Box, Estimate]:
        if frame.index >= self.raise_at:
            raise ValueError(self.text)
        return state, Estimate((state.cx, state.cy), (state.w, state.h), status="occluded")
