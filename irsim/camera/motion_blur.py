"""Motion blur: a frame is the mean of scenes over its exposure."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from irsim.config.base import Part

MAX_STEPS = 64

NO_BLUR = (0.0,)
"""Scene times of an instantaneous exposure: the frame's time alone."""


class MotionBlur(Part):
    """Motion blur of targets and background over the exposure, by their own motion and the camera's.

    A frame is the mean of `steps` scenes, evenly spread over the exposure. A motion of more than 1.2 px from step to
    step leaves separate dots rather than a streak: `irsim check` warns of it. Positions and boxes of ground truth are
    those of the frame's time, the middle of the exposure; centroid, visibility, occluders and masks are means over the
    exposure, and so is the share of a target that an occluder with the key `hides` covers. Smoke and clouds are static
    during the exposure.
    """

    time_ms: Annotated[float, Field(ge=0, le=10_000)] | None = None
    """Exposure time, ms, about the frame's time; 0 is no blur. By default the integration time of a detector of kind
    electrons."""
    steps: Annotated[int, Field(ge=1, le=MAX_STEPS)] = 8
    """Number of scenes averaged in a frame; rendering time grows in proportion."""

    def exposure_offsets(self, frames: float) -> tuple[float, ...]:
        """Return the times of the scenes of an exposure of `frames` frame periods, in periods from the frame's time."""
        if frames == 0 or self.steps == 1:
            return NO_BLUR
        return tuple(frames * ((k + 0.5) / self.steps - 0.5) for k in range(self.steps))
