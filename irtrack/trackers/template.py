"""`template`: matching by normalised cross-correlation, a baseline of Cheng et al. 2006."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.features.correlation import best_distractor, ncc, peak
from irtrack.features.window import Window, region
from irtrack.trackers.base import Footage, MonitoredTracker, VisibilityMonitor, footage, start_window
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class TemplateState:
    """State: template (rows, columns) counts; center (x, y) px of the last estimate; the best distractor's score."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    template: Floats
    center: tuple[float, float]
    distractor: float
    monitor: VisibilityMonitor


class Template(MonitoredTracker):
    """Normalised cross-correlation with the start box's patch over the whole frame or a window.

    The template matching of J. Cheng et al. 2006, section 3 (their reference 1), over the whole frame; the
    coefficient is Lewis's (Vision Interface 1995, eq. 2). The source leaves open the measure, sub-pixel
    peaks and the update of the template. The estimate is always the best match; where all scores are equal,
    as with a saturated target that fills its box, it is the last place. The template must lie in the frame,
    so a target that leaves is followed up to the edge.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Lewis 1995"

    window: int | None = Field(default=None, ge=1, le=10_000)
    """Half size of the search about the last estimate, px; without a value the whole frame."""
    update: Fraction = 0.0
    """Share of the new patch that enters the template where the target is visible."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> TemplateState:
        """Return the template, the part of the start box inside the frame."""
        window, corner = start_window(frame, box)
        template = window.cut(frame.image, corner).astype(np.float64)
        left, top, pixels = region(frame.image, window, corner, self.window)
        distractor = best_distractor(ncc(pixels, template), (corner[0] - left, corner[1] - top), window)
        return TemplateState(
            footage(frame), (box.w, box.h), window, template, (box.cx, box.cy), distractor, VisibilityMonitor()
        )

    def step(self, state: TemplateState, frame: Frame, rng: np.random.Generator) -> tuple[TemplateState, Estimate]:
        """Find the best match in the search region."""
        state.footage.check(frame)
        window = state.window
        corner = window.corner(state.center)
        left, top, pixels = region(frame.image, window, corner, self.window)
        (x, y), score = peak(ncc(pixels, state.template), (corner[0] - left, corner[1] - top))
        center = window.center((left + x, top + y))
        monitor = state.monitor.after(score, state.distractor, self.seen)
        template = state.template
        if self.update > 0 and monitor.misses == 0:
            patch = window.cut(frame.image, window.corner(center))
            template = (1 - self.update) * template + self.update * patch
        after = replace(state, template=template, center=center, monitor=monitor)
        return after, Estimate(center=center, size=state.size, status=monitor.status(self.lost_after), score=score)
