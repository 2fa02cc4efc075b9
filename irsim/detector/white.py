"""Noise without memory."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from irsim.detector.base import Additive, Moment, Ratio
from irsim.detector.grain import add_normals
from irsim.detector.response import Response
from irsim.rng import normals
from irsim.types import Floats


class White(Additive):
    """Independent from pixel to pixel and from frame to frame (tvh in 3-D noise terms)."""

    stationary: ClassVar[bool] = True

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""

    def pattern(self, moment: Moment) -> Floats:
        return normals(moment.shape, moment.seed, "noise", self.name, moment.index) * np.float32(self.ratio)

    def add(self, signal: Floats, response: Response, moment: Moment) -> None:
        add_normals(signal, self.ratio * response.noise, moment.seed, "noise", self.name, moment.index)

    def spread(self, moment: Moment, fixed: bool) -> float:
        return self.ratio**2
