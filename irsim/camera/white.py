"""Noise without memory."""

from __future__ import annotations

from typing import ClassVar

from irsim.camera.noise_base import FrameContext, Noise, Ratio
from irsim.camera.variance import Variance


class White(Noise):
    """Independent from pixel to pixel and from frame to frame (tvh in 3-D noise terms)."""

    stationary: ClassVar[bool] = True

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""

    def grain(self, frame_context: FrameContext) -> float:
        return self.ratio

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        return Variance(own=self.ratio**2)
