"""What all trackers of irtrack share: parameters, the check of frames, and an honest status."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.base import Part
from irsim.types import Box, Frame
from irtrack.errors import InputError
from irtrack.features.window import Window
from irtrack.types import Status

Deviation = Annotated[float, Field(ge=1e-3, le=1e4)]
"""A standard deviation in px, px/frame or px/frame^2: not so small that its square drowns beside a picture's
width, nor wider than any picture."""
Spread = Annotated[float, Field(ge=0, le=1e4)]
"""A standard deviation that may be nothing."""
Ratio = Annotated[float, Field(ge=1e-3, le=1e4)]
"""A pure number that multiplies or divides."""


class TrackerPart(Part):
    """A tracker whose fields are its parameters (see `irtrack.types.Tracker` for what it does)."""

    resumable: ClassVar[bool] = True
    source: ClassVar[str]
    """Who described the method."""


@dataclass(frozen=True, slots=True)
class Footage:
    """What must not change from frame to frame."""

    shape: tuple[int, int]
    dtype: np.dtype[np.uint8] | np.dtype[np.uint16]

    def check(self, frame: Frame) -> None:
        """InputError where a frame is of another size or type than the first."""
        if frame.image.shape != self.shape or frame.image.dtype != self.dtype:
            raise InputError(f"frame {frame.index}: {footage(frame)}; allowed: {self}, as the track began")

    def __str__(self) -> str:
        return f"{self.shape[1]}x{self.shape[0]} {self.dtype}"


def footage(frame: Frame) -> Footage:
    """Size and type of a frame; InputError where no tracker can use it."""
    image = frame.image
    if image.ndim != 2 or image.size == 0 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"frame {frame.index}: an image of shape {image.shape}, {image.dtype}; "
            "allowed: (rows, cols) of uint8 or uint16"
        )
    return Footage((image.shape[0], image.shape[1]), image.dtype)


def start_window(frame: Frame, box: Box) -> tuple[Window, tuple[int, int]]:
    """The part of the start box that lies in the frame, and its corner; InputError where none does."""
    if not (all(map(isfinite, (box.cx, box.cy, box.w, box.h))) and box.w > 0 and box.h > 0):
        raise InputError(f"start box {box}: allowed: finite numbers and a size above 0")
    shape = footage(frame).shape
    window = Window.of(box)
    part, corner = window.inside(window.corner((box.cx, box.cy)), shape)
    if part.rows == 0 or part.columns == 0:
        raise InputError(f"start box {box} lies outside the frame; allowed: a box that meets {shape[1]}x{shape[0]} px")
    return part, corner


LEVEL_RATE = 0.1
"""Share of a new score that enters the running level of `Sight`. Chosen here, no source speaks of it: a
memory of ten frames, slow enough that a hiding that sets in over some frames does not pull the level along."""

DISTINCT = 1e-5
"""Scores closer than this are the same. OpenCV's correlation sums in 32 bits (rounding 6e-8 of each of
some hundred terms); without it a constant frame would show a target."""


@dataclass(frozen=True, slots=True)
class Sight:
    """Whether the target is seen, judged by a score against what this scene can give.

    A fixed threshold on a likeness fails: noise alone costs a histogram of n pixels
    E[1 - rho] = (B - 1) / (8 n), so that a small target never reaches what a large one always has.
    So the scene sets the scale: the floor is the score of what is not the target, the level a
    running mean of the score while the target was seen. The target is seen where its score passes
    floor + share (level - floor), and the floor in any case.

    missed is the number of frames in a row in which it was not seen.
    """

    level: float | None = None
    missed: int = 0

    def after(self, score: float, floor: float, share: float) -> Sight:
        """The sight after a frame of this score."""
        level = floor if self.level is None else self.level
        if score <= floor + max(share * (level - floor), DISTINCT):
            return self.unseen()
        return Sight(score if self.level is None else level + LEVEL_RATE * (score - level))

    def seen(self) -> Sight:
        """The sight after a frame in which the target was found by a measure without a score."""
        return replace(self, missed=0)

    def unseen(self) -> Sight:
        """The sight after a frame in which the target was not found."""
        return replace(self, missed=self.missed + 1)

    def status(self, lost_after: int) -> Status:
        """tracking; occluded while unseen; lost from `lost_after` unseen frames in a row on."""
        if self.missed == 0:
            return "tracking"
        return "lost" if self.missed >= lost_after else "occluded"
