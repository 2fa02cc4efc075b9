"""`frame_difference`: the frame less an earlier one that is registered to it."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.types import MEDIAN_TO_SIGMA
from irtrack.detectors.base import FilterDetector
from irtrack.detectors.peaks import ROUNDING, Picture, median
from irtrack.errors import InputError
from irtrack.features.background import BackgroundModel

COARSE = 3
"""Factor by which frames are reduced for registration. A factor of 3 takes half the time of a factor of 2, and leaves
2 % more residual on ground."""


@dataclass(frozen=True, slots=True, eq=False)
class LastFrames:
    """Pictures of the last frames, the oldest first, and the same reduced for registration; counts."""

    pictures: tuple[Picture, ...]
    reduced: tuple[Picture, ...]


class FrameDifference(FilterDetector):
    """Difference from the frame `lag` frames ago, registered by shift, gain and offset.

    R. Jain, H.-H. Nagel, "On the analysis of accumulative difference pictures", IEEE PAMI 1(2), 1979; the registration
    is that of `irtrack.features.background`, at a third of the size. A target that moved appears at its new place, and
    with the other sign at its old place; it must move by more than its size within `lag` frames. The first frame has no
    detections; frames 1 to `lag` are compared with frame 0. Pixels that came into view have the response 0.
    """

    source: ClassVar[str] = "Jain, Nagel 1979"

    lag: int = Field(default=3, ge=1, le=100)
    """Number of frames from the earlier frame to the present one."""
    align: bool = True
    """True: the earlier frame is registered first; false for a camera at rest."""
    psf: float = Field(default=0.7, ge=0, le=10)
    """Standard deviation of the Gaussian that smooths the difference, px; 0: none."""

    @property
    def smoothing(self) -> float:
        return max(self.psf, super().smoothing)

    def respond(self, memory: LastFrames | None, picture: Picture) -> tuple[Any, Picture | None]:
        now = reduced(picture) if self.align else picture
        if memory is None:
            return LastFrames((picture,), (now,)), None
        earlier = memory.pictures[0]
        if earlier.shape != picture.shape:
            raise InputError(
                f"a frame of {picture.shape[1]}x{picture.shape[0]} px; "
                f"allowed: {earlier.shape[1]}x{earlier.shape[0]}, as before"
            )
        difference: Any = picture - (registered(earlier, picture, memory.reduced[0], now) if self.align else earlier)
        if self.psf > 0:
            difference = cv2.GaussianBlur(difference, (0, 0), self.psf, borderType=cv2.BORDER_REFLECT_101)
        kept = ((*memory.pictures, picture)[-self.lag :], (*memory.reduced, now)[-self.lag :])
        return LastFrames(*kept), difference


def registered(earlier: Picture, picture: Picture, before: Picture, now: Picture) -> Picture:
    """Return the earlier picture registered to a later one in place and grey scale; pixels that it lacks are taken from
    the later one.

    before, now   both reduced
    """
    model, dx, dy = displacement(before, now)
    if max(abs(dx), abs(dy)) < 1e-2:
        return earlier * np.float32(model.gain) + np.float32(model.offset)
    matrix = np.array([[1.0, 0, dx], [0, 1.0, dy]])
    moved = cv2.warpAffine(earlier, matrix, earlier.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    moved = moved * np.float32(model.gain) + np.float32(model.offset)
    across, down = (ceil(abs(d)) + 1 if abs(d) >= 1e-2 else 0 for d in (dx, dy))
    rows, columns = moved.shape
    for new in (
        (slice(0, down) if dy > 0 else slice(rows - min(down, rows), rows), slice(None)),
        (slice(None), slice(0, across) if dx > 0 else slice(columns - min(across, columns), columns)),
    ):
        moved[new] = picture[new]
    return moved


def displacement(before: Picture, now: Picture) -> tuple[BackgroundModel, float, float]:
    """Return an earlier reduced picture as a model registered to a later one, and the scene's shift (dx, dy), px."""
    steps = np.abs(np.diff(before[::4], axis=1)).ravel()
    noise = max((MEDIAN_TO_SIGMA * median(steps)) ** 2 / 2, ROUNDING**2) if steps.size else ROUNDING**2
    ones = np.ones_like(before)
    brighter = float(now.mean() - before.mean())
    model = BackgroundModel(before, ones, ones, noise, offset=brighter).aligned(now)
    return model, COARSE * model.shift[0], COARSE * model.shift[1]


def reduced(picture: Picture) -> Picture:
    size = max(picture.shape[1] // COARSE, 1), max(picture.shape[0] // COARSE, 1)
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)  # type: ignore[return-value]  # OpenCV's stubs know no element types
