"""What a noise is, and what it may know."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.camera.int16_image import Words
from irsim.camera.response import Lines, Response
from irsim.camera.variance import Variance
from irsim.config.base import NamedKind
from irsim.types import Counts, Floats

Ratio = Annotated[float, Field(ge=0, le=1000)]
"""A sigma in units of the camera's NETD."""

AT_ONCE = 32
"""What is little in a frame is drawn for so many frames together: an address costs as much as a thousand numbers."""


@dataclass(frozen=True)
class FrameContext:
    """A frame as noise sees it.

    index of the frame; shape (rows, cols); rate_hz; seed of the scene; corrected, the frame of the last
    non-uniformity correction (0 where there was none yet); corrections, how many there were so far.
    """

    index: int
    shape: tuple[int, int]
    rate_hz: float
    seed: int
    corrected: int = 0
    corrections: int = 0


class Noise(NamedKind):
    """One term of a detector's noise. It overrides what it has to do with a frame, and tells its variance.

    `signal` is the frame so far, (rows, cols) float32 in the units of `response`, and is changed in
    place. Everything random but its grain is addressed by the seed, self.name, a word for what it is and the index,
    or index // AT_ONCE: the same whatever frames were asked for before.
    """

    stationary: ClassVar[bool] = False
    """Whether its `share` is known to be the same in all frames: it is asked once then; and what is `steady` of it is
    summed up before what others have, which may change. A subclass with another share says this anew."""

    def gains(self, frame_context: FrameContext) -> Floats | None:
        """By what share each pixel answers more to light, before it saturates: (rows, cols) float32, read only; None
        where all answer alike."""
        return None

    def grain(self, frame_context: FrameContext) -> float:
        """Sigma of what is new in each pixel of this frame, whatever the light, in units of NETD.

        What all noises have of it is one draw a pixel, as the sum of independent normal numbers is normal; the number
        drawn is the same whichever noises there are (`irsim.camera.temporal_sigma`)."""
        return 0.0

    def count(self, signal: Floats, response: Response, frame_context: FrameContext, sigma: float) -> None:
        """Put numbers of electrons in place of each pixel's mean, with the grain of that sigma, in units of signal. One
        noise of a detector at most does so."""

    def add(self, signal: Floats, response: Response, frame_context: FrameContext) -> None:
        """Add to what was read: after pixels saturate, and grain is drawn."""

    def lines(self, frame_context: FrameContext) -> Lines | None:
        """What is added as well along whole rows, (rows,), and columns, (cols,), in units of NETD, float32, read only;
        None where nothing is."""
        return None

    def lasting(self, frame_context: FrameContext) -> Sequence[Words]:
        """What is added as well, and is kept for later frames, in units of NETD."""
        return ()

    def steady(self, frame_context: FrameContext) -> Floats | None:
        """What is added as well, and stays for many frames: broadcastable to (rows, cols), float32, in units of
        NETD, None where it is nothing. Read only, and the same array as long as it is the same: what all noises
        have of it is summed up once."""
        return None

    def replace(self, counts: Counts, response: Response, frame_context: FrameContext) -> None:
        """Put others in place of the counts: last."""

    @abstractmethod
    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        """What it adds to the variance of a pixel that does what the others do.

        Without `fixed`, of what changes from frame to frame only.
        """

    def variance(self, signal: Floats, response: Response, frame_context: FrameContext, fixed: bool) -> Floats | float:
        """Variance that this term gives each pixel about the noiseless `signal`, in squared units of it.

        Over all draws of the scene's seed; see `share` for `fixed`. Broadcastable to the signal; infinite where a
        pixel says nothing of the light.
        """
        return self.share(frame_context, fixed).whole(signal.astype(np.float64), response)

    @property
    def needs_electrons(self) -> bool:
        """Whether it can act only where the signal is in electrons."""
        return False


class Additive(Noise):
    """A noise that is added, whatever the light."""

    @abstractmethod
    def pattern(self, frame_context: FrameContext) -> Floats:
        """The frame's noise, broadcastable to (rows, cols), float32, in units of NETD. Read only."""

    @abstractmethod
    def spread(self, frame_context: FrameContext, fixed: bool) -> float:
        """Variance of a pixel of the pattern in squared units of NETD; see `share` for `fixed`."""

    def add(self, signal: Floats, response: Response, frame_context: FrameContext) -> None:
        pattern = self.pattern(frame_context)
        if pattern.shape == signal.shape:
            cv2.scaleAdd(pattern, response.noise, signal, dst=signal)
        else:
            np.add(signal, pattern * np.float32(response.noise), out=signal)

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        return Variance(own=self.spread(frame_context, fixed))


class Steady(Additive):
    """A noise whose whole pattern stays: the same array in frames in which it is the same."""

    def add(self, signal: Floats, response: Response, frame_context: FrameContext) -> None:
        return None

    def steady(self, frame_context: FrameContext) -> Floats:
        return self.pattern(frame_context)


def read_only(values: Floats) -> Floats:
    """The array, from now on protected."""
    values.flags.writeable = False
    return values
