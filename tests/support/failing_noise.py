"""Noise kind that cannot be drawn in one frame."""

from __future__ import annotations

import numpy as np

from irsim.camera.noise_base import Additive, FrameContext
from irsim.types import Floats


class Failing(Additive):
    """Silent noise that raises ValueError in frame `at`."""

    at: int

    def pattern(self, frame_context: FrameContext) -> Floats:
        if frame_context.index == self.at:
            raise ValueError(f"frame {self.at} cannot be")
        return np.zeros((1, 1), np.float32)

    def pattern_variance(self, frame_context: FrameContext, fixed: bool) -> float:
        return 0.0
