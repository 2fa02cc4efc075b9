"""Noise without memory."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.detector.base import Additive, Moment, Ratio
from irsim.detector.response import Response
from irsim.detector.scratch import scratch
from irsim.rng import normals
from irsim.types import Floats


class White(Additive):
    """Independent from pixel to pixel and from frame to frame (tvh in 3-D noise terms)."""

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""

    def pattern(self, moment: Moment) -> Floats:
        return self._draw(moment, None) * np.float32(self.ratio)

    def add(self, signal: Floats, response: Response, moment: Moment) -> None:
        drawn = self._draw(moment, scratch(moment.shape, "drawn"))
        cv2.scaleAdd(drawn, self.ratio * response.noise, signal, dst=signal)

    def _draw(self, moment: Moment, out: npt.NDArray[np.float32] | None) -> Floats:
        return normals(moment.shape, moment.seed, "noise", self.name, moment.index, out=out)

    def spread(self, moment: Moment, fixed: bool) -> float:
        return self.ratio**2
