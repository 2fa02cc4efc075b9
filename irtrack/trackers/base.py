"""Base of all trackers: parameters, the check of frames, and the visibility monitor behind their status."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.base import Part
from irsim.config.quantities import Fraction
from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.features.window import Window
from irtrack.types import Status

Deviation = Annotated[float, Field(ge=1e-3, le=1e4)]
"""Standard deviation in px, px/frame or px/frame^2, within bounds that keep its square exact enough."""
Spread = Annotated[float, Field(ge=0, le=1e4)]
"""Standard deviation that may be 0, in px or px/frame."""
Ratio = Annotated[float, Field(ge=1e-3, le=1e4)]
"""Factor or divisor without unit."""


class TrackerPart(Part):
    """Tracker whose fields are its parameters; subclasses have `init` and `step` (see `irtrack.types.Tracker`)."""

    resumable: ClassVar[bool] = True
    source: ClassVar[str]
    """Authors and year of the method."""


@dataclass(frozen=True, slots=True)
class Footage:
    """Size and type of the frames of a track."""

    shape: tuple[int, int]
    dtype: np.dtype[np.uint8] | np.dtype[np.uint16]

    def check(self, frame: Frame) -> None:
        """Raise InputError where a frame is of another size or type than the first."""
        if frame.image.shape != self.shape or frame.image.dtype != self.dtype:
            raise InputError(f"frame {frame.index}: {footage(frame)}; allowed: {self}, as the track began")

    def __str__(self) -> str:
        return f"{self.shape[1]}x{self.shape[0]} {self.dtype}"


def footage(frame: Frame) -> Footage:
    """Return size and type of a frame; InputError where trackers cannot use the frame."""
    image = frame.image
    if image.ndim != 2 or image.size == 0 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"frame {frame.index}: an image of shape {image.shape}, {image.dtype}; "
            "allowed: (rows, cols) of uint8 or uint16"
        )
    return Footage((image.shape[0], image.shape[1]), image.dtype)


def start_window(frame: Frame, box: Box) -> tuple[Window, tuple[int, int]]:
    """Return the window of the start box inside the frame, and its corner; InputError where it is empty."""
    if not (all(map(isfinite, (box.cx, box.cy, box.w, box.h))) and box.w > 0 and box.h > 0):
        raise InputError(f"start box {box}: allowed: finite numbers and a size above 0")
    shape = footage(frame).shape
    window = Window.of(box)
    part, corner = window.inside(window.corner((box.cx, box.cy)), shape)
    if part.rows == 0 or part.columns == 0:
        raise InputError(f"start box {box} lies outside the frame; allowed: a box that meets {shape[1]}x{shape[0]} px")
    return part, corner


class MonitoredTracker(TrackerPart):
    """Mixin of trackers whose status is that of a `VisibilityMonitor`."""

    seen: Fraction = 0.5
    """Least score of a visible target: the share of the way from the background score (the score of the target's
    surroundings, or of the best distractor) to the usual score of the visible target."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Number of successive misses after which the status is lost."""


LEVEL_RATE = 0.1
"""Share of a new score in the running mean of a `VisibilityMonitor`. Chosen here: a memory of ten frames, so that an
occlusion with a slow beginning does not lower the level."""

DISTINCT = 1e-5
"""Scores closer than this are equal. OpenCV's correlation sums in 32 bits (rounding 6e-8 of each of some hundred
terms); without this bound a constant frame would count as a hit."""


@dataclass(frozen=True, slots=True)
class VisibilityMonitor:
    """Decision on the visibility of the target, by its score relative to the scores usual in the scene.

    A fixed threshold on a similarity fails: noise alone costs a histogram of n pixels E[1 - rho] = (B - 1) / (8 n), so
    that a small target never reaches the score of a large one. A hit is a score above background score + share (level -
    background score), and in any case above the background score, which is the score of the target's surroundings or of
    the best distractor.

    level    running mean of the score while the target was visible
    misses   number of successive frames without a hit
    """

    level: float | None = None
    misses: int = 0

    def after(self, score: float, background_score: float, share: float) -> VisibilityMonitor:
        """Return the monitor after a frame with this score of the target."""
        level = background_score if self.level is None else self.level
        if score <= background_score + max(share * (level - background_score), DISTINCT):
            return self.miss()
        return VisibilityMonitor(score if self.level is None else level + LEVEL_RATE * (score - level))

    def hit(self) -> VisibilityMonitor:
        """Return the monitor after a frame in which the target was found by a measurement without a score."""
        return replace(self, misses=0)

    def miss(self) -> VisibilityMonitor:
        """Return the monitor after a frame in which the target was not found."""
        return replace(self, misses=self.misses + 1)

    def status(self, lost_after: int) -> Status:
        """Return tracking after a hit; occluded after a miss; lost from `lost_after` misses in a row on."""
        if self.misses == 0:
            return "tracking"
        return "lost" if self.misses >= lost_after else "occluded"
