"""Noise without memory."""

from __future__ import annotations

import numpy as np

from irsim.detector.base import Noise, Ratio
from irsim.rng import normals
from irsim.types import Floats


class White(Noise):
    """Independent from pixel to pixel and from frame to frame (tvh in 3-D noise terms)."""

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""

    def pattern(self, index: int, shape: tuple[int, int], rate_hz: float, seed: int) -> Floats:
        drawn = normals(shape, seed, "noise", self.name, index)
        return np.multiply(drawn, np.float32(self.ratio), out=drawn)
