"""A detector that follows the light slowly."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np

from irsim.types import Floats

FORGOTTEN = 1e-3
"""Frames whose weight, with all before them, is below this are taken for one."""


def weights(time_constant_s: float, rate_hz: float) -> Floats:
    """Weights, sum 1, of the present frame's light, of the one before it, and so on.

    A first-order low-pass, y[k] = a y[k-1] + (1 - a) x[k] with a = exp(-1 / (rate time constant)): light
    that is the same throughout a frame, seen at the frame's end. It starts `len(weights)` - 1 frames
    before, settled at the light of that frame.
    """
    kept = math.exp(-1 / (rate_hz * time_constant_s)) if time_constant_s else 0.0
    if kept <= FORGOTTEN:
        return np.ones(1)
    frames = math.ceil(math.log(FORGOTTEN) / math.log(kept))
    return np.append((1 - kept) * kept ** np.arange(frames), kept**frames)


class Lag:
    """The light that a detector has settled to. What it keeps of earlier frames changes no result."""

    def __init__(self, time_constant_s: float, rate_hz: float) -> None:
        self.weights = weights(time_constant_s, rate_hz)
        self._kept: dict[int, Floats] = {}

    @property
    def remembers(self) -> bool:
        """Whether it needs earlier frames' light."""
        return len(self.weights) > 1

    def light(self, index: int, scene: Callable[[int], Floats]) -> Floats:
        """(rows, cols) float32: scene(index) low-passed over the frames before; before frame 0 the light was its."""
        if not self.remembers:
            return scene(index)
        wanted = [max(index - back, 0) for back in range(len(self.weights))]
        known = self._kept  # once: another thread may put its own there
        lights = self._kept = {frame: known[frame] if frame in known else scene(frame) for frame in wanted}
        total = np.zeros_like(lights[index])
        for frame, weight in zip(wanted, self.weights, strict=True):
            cv2.scaleAdd(lights[frame], float(weight), total, dst=total)
        return total
