"""`histogram_moments`: mean shift, then an exhaustive search by grey histogram and invariant moments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.histogram import bhattacharyya_distance
from irtrack.features.moments import invariants_around, moment_likeness
from irtrack.trackers.appearance import Appearance, MeanShiftSearch, blend
from irtrack.trackers.base import VisibilityMonitor
from irtrack.trackers.match_map import MatchMap
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class HistogramMomentsState:
    """State: center (2,) px of the last estimate; reference invariants; level and sign of the target's contrast."""

    appearance: Appearance
    reference: Floats
    invariants: Floats
    level: float
    sign: float
    confidence: tuple[float, float]
    center: Floats
    monitor: VisibilityMonitor


class HistogramMoments(MeanShiftSearch):
    """Mean shift from the last position, then an exhaustive search by the fused likeness of histogram and moments.

    Guan, Chen, Qian 2008 (reference 9 in Xue et al. 2011, who describe it: histogram and invariant moments fused, mean
    shift and exhaustive search; more is not available). Fused likeness of a window:

        L_y rho(p, q) + L_d exp(-|ln Hu - ln Hu_0|)

    rho: Bhattacharyya coefficient of grey histograms; Hu: first four invariants of the counts beyond the background's
    level (logarithms: `irtrack.features.moments.log_hu`). The confidences L of the cues are those of Li and Li 2014
    (eq. 9, 10; here the bounded distance of the reference from the ring around the window, and 1 - likeness of windows
    beside it). The search covers `reach` px about the mode. The monitor's score is that of the histogram.
    """

    source: ClassVar[str] = "Guan, Chen, Qian 2008; Hu 1962"

    cues: Literal["both", "histogram", "moments"] = "both"
    """Cues of the search; a single one has the confidence 1."""
    shift: bool = True
    """True: mean shift before the search."""
    reach: int = Field(default=8, ge=0, le=30)
    """Half side of the search, px; 0: mean shift alone."""
    alpha: Fraction = 0.0
    """Share of the estimate's histogram that enters the reference where the target is visible."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> HistogramMomentsState:
        """Return the references of both cues and their confidences."""
        appearance, reference = self.appearance(frame, box)
        picture, center = appearance.picture(frame), np.array([box.cx, box.cy])
        columns, rows = appearance.window.columns, appearance.window.rows
        corner = appearance.window.corner((box.cx, box.cy))
        part, at = appearance.window.inside(corner, (picture.shape[0], picture.shape[1]))
        pixels = part.cut(picture, at).astype(np.float64)
        level = float(np.median(_ring(picture, corner, columns, rows)))
        sign = 1.0 if pixels.mean() >= level else -1.0
        wide = max(columns, rows)
        every = invariants_around(picture, appearance.window, corner, wide, level, sign)
        invariants = every[wide, wide]
        windows, _ = appearance.background.histograms(picture, (box.cx, box.cy))
        beside = moment_likeness(every[[0, wide, -1, wide], [wide, 0, wide, -1]], invariants)
        both = np.array([bhattacharyya_distance(reference, windows[1]), 1 - float(beside.mean())])
        if self.cues != "both" or both.sum() <= 0:
            both = np.array({"both": (0.5, 0.5), "histogram": (1.0, 0.0), "moments": (0.0, 1.0)}[self.cues])
        y, d = (both / both.sum()).tolist()
        return HistogramMomentsState(
            appearance, reference, invariants, level, sign, (y, d), center, VisibilityMonitor()
        )

    def step(
        self, state: HistogramMomentsState, frame: Frame, rng: np.random.Generator
    ) -> tuple[HistogramMomentsState, Estimate]:
        """Move by mean shift, then to the best window about the mode."""
        appearance, center = state.appearance, state.center
        picture = appearance.picture(frame)
        if self.shift:
            modes = self.mean_shift_modes(appearance, picture, center[None], state.reference)
            center = modes.centers[0] if modes.visible[0] > 0 else center
        found = MatchMap.of(appearance, picture, center, self.reach, 1.0, state.reference)
        in_view = bool(found.rho.any())
        if in_view and self.reach > 0:
            fused = state.confidence[0] * found.rho
            if state.confidence[1] > 0:
                corner = appearance.window.corner((float(center[0]), float(center[1])))
                hu = invariants_around(picture, appearance.window, corner, self.reach, state.level, state.sign)
                likeness = moment_likeness(hu, state.invariants).ravel()
                fused = fused + state.confidence[1] * likeness * (found.rho > 0)
            center = MatchMap(found.places, fused, 1.0).best
        match = appearance.match(picture, center, state.reference)
        monitor = self.monitor_after(state.monitor, match, in_view)
        after = HistogramMomentsState(
            appearance=appearance,
            reference=blend(state.reference, match, self.alpha) if monitor.misses == 0 else state.reference,
            invariants=state.invariants,
            level=state.level,
            sign=state.sign,
            confidence=state.confidence,
            center=center,
            monitor=monitor,
        )
        x, y = center.tolist()
        vx, vy = (center - state.center).tolist()
        status = self.status(monitor, in_view)
        return after, Estimate((x, y), appearance.size, status, match.score, velocity=(vx, vy))


def _ring(image: Image, corner: tuple[int, int], columns: int, rows: int) -> Image:
    """Return the pixels of three windows' sides about a window, the window included."""
    x, y = corner
    left, top = max(x - columns, 0), max(y - rows, 0)
    return image[top : y + 2 * rows, left : x + 2 * columns]
