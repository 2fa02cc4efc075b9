"""Blur by motion while a frame is exposed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from irsim.config.base import Part

MOST_STEPS = 64


class Smear(Part):
    """Whatever moves while a frame is exposed is smeared along its way: the targets' own motion and the camera's.

    A frame is the mean of `steps` scenes, evenly spread over the exposure. What moves by more than
    1.2 px from step to step leaves beads rather than a streak: `irsim check` warns of it. Truth's places and boxes are
    those of the frame's time, the middle; the centroid of a target's light, how much of it is hidden, by whom, and
    masks are of the whole exposure, and so is what an occluder with an intent hides. Smoke and clouds stand still for
    it.
    """

    time_ms: Annotated[float, Field(ge=0, le=10_000)] | None = None
    """Integration time, ms, about the frame's time; with 0 nothing is smeared. Where not given, that of a detector that
    counts electrons."""
    steps: Annotated[int, Field(ge=1, le=MOST_STEPS)] = 8
    """Scenes that make up a frame: drawing takes about so many times as long."""

    def instants(self, frames: float) -> tuple[float, ...]:
        """When the scenes are that make up a frame which is exposed for so many frames' time: frames from its own,
        evenly spread about it."""
        if frames == 0 or self.steps == 1:
            return SHARP
        return tuple(frames * ((k + 0.5) / self.steps - 0.5) for k in range(self.steps))


SHARP = (0.0,)
"""The instants of an exposure that takes no time."""
