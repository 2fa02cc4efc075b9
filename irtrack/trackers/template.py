"""`template`: matching by normalised cross-correlation, the classic that Cheng et al. compare with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.features.correlation import ncc, peak, rival
from irtrack.features.window import Window, region
from irtrack.trackers.base import Footage, Sight, TrackerPart, footage, start_window
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class TemplateState:
    """template (rows, columns) counts; center (x, y) px of the last estimate; floor, the best false match's score."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    template: Floats
    center: tuple[float, float]
    floor: float
    sight: Sight


class Template(TrackerPart):
    """Normalised cross-correlation with the start box's patch over the whole frame or a window.

    The method is the template matching of J. Cheng et al. 2006, section 3 (their reference 1), which
    searches the whole frame; the coefficient is Lewis's (Vision Interface 1995, eq. 2). The source
    leaves open the measure, sub-pixel peaks and whether the template is updated: not updated by
    default. The estimate is always the best match, also where the status says that it is none; where all
    match alike, as with a template without structure (a saturated target that fills its box), the last
    place. The template must lie in the frame, so a target that leaves is followed up to the edge.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Lewis 1995"

    window: int | None = Field(default=None, ge=1, le=10_000)
    """Half size of the search about the last estimate, px; without a value the whole frame."""
    update: Fraction = 0.0
    """Share of the new patch that enters the template where the target is seen."""
    seen: Fraction = 0.5
    """Share of the way from the best false match's score to the target's usual one that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without sight after which the status is lost."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> TemplateState:
        """The template is the part of the start box that lies in the frame."""
        window, corner = start_window(frame, box)
        template = window.cut(frame.image, corner).astype(np.float64)
        left, top, searched = region(frame.image, window, corner, self.window)
        floor = rival(ncc(searched, template), (corner[0] - left, corner[1] - top), window)
        return TemplateState(footage(frame), (box.w, box.h), window, template, (box.cx, box.cy), floor, Sight())

    def step(self, state: TemplateState, frame: Frame, rng: np.random.Generator) -> tuple[TemplateState, Estimate]:
        """The best match in the region searched."""
        state.footage.check(frame)
        window = state.window
        corner = window.corner(state.center)
        left, top, searched = region(frame.image, window, corner, self.window)
        (x, y), score = peak(ncc(searched, state.template), (corner[0] - left, corner[1] - top))
        center = window.center((left + x, top + y))
        sight = state.sight.after(score, state.floor, self.seen)
        template = state.template
        if self.update > 0 and sight.missed == 0:
            patch = window.cut(frame.image, window.corner(center))
            template = (1 - self.update) * template + self.update * patch
        after = replace(state, template=template, center=center, sight=sight)
        return after, Estimate(center=center, size=state.size, status=sight.status(self.lost_after), score=score)
