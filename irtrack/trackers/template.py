"""`template`: matching by normalised cross-correlation, a baseline of Cheng et al. 2006."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Frame
from irtrack.features.correlation import Patch
from irtrack.trackers.base import Footage, MonitoredTracker, VisibilityMonitor, footage, start_window
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class TemplateState:
    """State: the template; center (x, y) px of the last estimate."""

    footage: Footage
    size: tuple[float, float]
    patch: Patch
    center: tuple[float, float]
    monitor: VisibilityMonitor


class Template(MonitoredTracker):
    """Normalised cross-correlation with the start box's patch over the whole frame or a window.

    The template matching of J. Cheng et al. 2006, section 3 (their reference 1), over the whole frame; the
    coefficient is Lewis's (Vision Interface 1995, eq. 2). The paper leaves open the measure, sub-pixel peaks and the
    update of the template. The estimate is always the best match; where all scores are equal, as for a saturated target
    that fills its box, the last position is kept. The template must lie in the frame, so that a target that leaves is
    followed up to the edge.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Lewis 1995"

    window: int | None = Field(default=None, ge=1, le=10_000)
    """Largest displacement from the last estimate in the search, px; by default the whole frame is searched."""
    update: Fraction = 0.1
    """Share of the new patch that enters the template where the target is visible, by search on development seeds."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> TemplateState:
        """Return the template, the part of the start box inside the frame."""
        patch = Patch.of(frame.image, *start_window(frame, box), self.window)
        return TemplateState(footage(frame), (box.w, box.h), patch, (box.cx, box.cy), VisibilityMonitor())

    def step(self, state: TemplateState, frame: Frame, rng: np.random.Generator) -> tuple[TemplateState, Estimate]:
        """Find the best match in the search region."""
        state.footage.check(frame)
        patch = state.patch
        center, score = patch.search(frame.image, state.center, self.window)
        monitor = state.monitor.after(score, patch.distractor, self.seen)
        if self.update > 0 and monitor.misses == 0:
            patch = patch.blended(frame.image, center, self.update)
        after = replace(state, patch=patch, center=center, monitor=monitor)
        return after, Estimate(center=center, size=state.size, status=monitor.status(self.lost_after), score=score)
