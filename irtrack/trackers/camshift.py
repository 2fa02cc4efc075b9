"""`camshift_kalman`: centroid and ellipse by CamShift, predicted through occlusion by a Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from typing import Annotated, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.histogram import LocalBackground, gaussian_kernel
from irtrack.features.mean_shift import back_projection
from irtrack.features.quantiser import BinsRange, Quantiser, first_quantiser
from irtrack.features.window import Window, region
from irtrack.trackers.base import Footage, MonitoredTracker, VisibilityMonitor, footage, start_window
from irtrack.trackers.kalman import GatedKalman, kalman_estimate
from irtrack.types import Estimate

CONVERGED = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.5)
"""Termination: at most 20 iterations, or a step below 0.5 px; OpenCV's window moves by whole pixels."""
SIZES = (0.5, 2.0)
"""Least and largest size, in start sizes. Chosen here, since the ellipse grows without end on a background with the
target's grey levels."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Settings taken from the first frame. `likely` (bins,): weight of each grey level, 0 .. 1; `histogram` (bins,):
    reference of matches; `ellipse`: full axes (w, h) of the target, px."""

    footage: Footage
    size: tuple[float, float]
    levels: Quantiser
    likely: Floats
    background: LocalBackground
    histogram: Floats
    ellipse: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class CamShiftState:
    """State: mean (4,) = x, y px, vx, vy px/frame, and its covariance; scale (2,), size over start size."""

    start: Start
    mean: Floats
    covariance: Floats
    scale: Floats
    monitor: VisibilityMonitor


class CamShiftKalman(GatedKalman, MonitoredTracker):
    """CamShift in a window predicted by a Kalman filter, whose prediction is the position during occlusion.

    A digest found with An et al. 2007 names this system: CamShift measures a centroid and an ellipse; a Kalman filter
    predicts the next window, and the position while targets overlap. CamShift is that of G. Bradski, "Computer Vision
    Face Tracking for Use in a Perceptual User Interface", Intel Technology Journal Q2, 1998: mean shift on the back
    projection of the target's levels, then the moments of the back projection in the window.

    Chosen here: grey levels in place of hue; a level's weight is its share in the target relative to its share in a
    ring, since the target's share alone draws the window into a similar background; smoothed sizes, from the ellipse's
    second moments relative to the first frame's; constant velocity with white-noise acceleration; occlusion by the
    match at the position found (see `irtrack.trackers.base.VisibilityMonitor`) and by the gate.
    """

    source: ClassVar[str] = "Bradski 1998; Kalman 1960"

    bins: int = Field(default=32, ge=2, le=256)
    """Grey levels of the histogram."""
    bins_range: BinsRange = "first_frame"
    """Grey range of the bins: that of the first frame for all frames, or the full range of the bit depth."""
    weights: Literal["ratio", "share"] = "ratio"
    """Weight of a grey level: its share in the target over its shares in target and ring, or its share in the target
    alone (Bradski)."""
    resize: Fraction = 0.1
    """Share of the ellipse's new size that enters the estimate; 0: the size stays."""
    margin: Annotated[float, Field(ge=0, le=10)] = 0.25
    """Margin of the search window beyond the target on each side, in sides of the target, so that the window does not
    cut the target."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> CamShiftState:
        """Return the state at the box's centre, with speed 0 of standard deviation `start_speed_sd`."""
        part, corner = start_window(frame, box)
        window, center = Window.of(box), (box.cx, box.cy)
        levels = first_quantiser(frame, part.cut(frame.image, corner), self.bins, self.bins_range)
        reach = (ceil(window.columns / 2), ceil(window.rows / 2))
        kernel = gaussian_kernel(window, 0.5 * float(np.hypot(box.w, box.h)))
        background = LocalBackground.of(window, kernel, reach, levels)
        (target, ring), _ = background.histograms(frame.image, center)
        total = target + ring
        ratio = np.divide(target, total, out=np.zeros_like(target), where=total > 0)
        start = Start(
            footage=footage(frame),
            size=(box.w, box.h),
            levels=levels,
            likely=np.maximum(2 * ratio - 1, 0) if self.weights == "ratio" else target,
            background=background,
            histogram=target,
            ellipse=(1.0, 1.0),
        )
        found = self._found(start, frame.image, np.array(center), np.ones(2))
        first = replace(start, ellipse=found[1] if found else (1.0, 1.0))
        return CamShiftState(first, *self.start(box), np.ones(2), VisibilityMonitor())

    def step(self, state: CamShiftState, frame: Frame, rng: np.random.Generator) -> tuple[CamShiftState, Estimate]:
        """Predict the window, move it by CamShift, and update the filter by the centroid."""
        start, image = state.start, frame.image
        start.footage.check(frame)
        mean, covariance = self.predict(state.mean, state.covariance)
        found = self._found(start, image, mean[:2], state.scale)
        monitor, score, scale = state.monitor.miss(), 0.0, state.scale
        if found is not None:
            place, ellipse = found
            match = start.background.score(image, (float(place[0]), float(place[1])), start.histogram)
            score = match.score
            if self.within_gate(mean, covariance, place):
                monitor = state.monitor.after(score, match.background_score, self.seen)
            if monitor.misses == 0:
                mean, covariance = self.updated(mean, covariance, place)
                now = np.clip(np.divide(ellipse, start.ellipse), *SIZES)
                scale = scale + self.resize * (now - scale)
        after = replace(state, mean=mean, covariance=covariance, scale=scale, monitor=monitor)
        size = (float(scale[0]) * start.size[0], float(scale[1]) * start.size[1])
        return after, kalman_estimate(mean, covariance, size, monitor.status(self.lost_after), score)

    def _found(
        self, start: Start, image: Image, center: Floats, scale: Floats
    ) -> tuple[Floats, tuple[float, float]] | None:
        """Return centroid (2,) px and full axes (w, h) px of the ellipse in the last window; None where it is empty."""
        columns, rows = (
            min(ceil((1 + 2 * self.margin) * factor * side), limit)
            for factor, side, limit in zip(scale.tolist(), start.size, image.shape[::-1], strict=True)
        )
        window = Window(columns, rows, (0.0, 0.0))
        corner = window.corner((float(center[0]), float(center[1])))
        # Weights are looked up only within the distance that a target moves in a frame.
        left, top, pixels = region(image, window, corner, 2 * max(columns, rows))
        picture = back_projection(pixels, start.levels, start.likely).astype(np.float32)
        x = min(max(corner[0] - left, 0), picture.shape[1] - window.columns)
        y = min(max(corner[1] - top, 0), picture.shape[0] - window.rows)
        _, (x, y, w, h) = cv2.meanShift(picture, (x, y, window.columns, window.rows), CONVERGED)
        moments = cv2.moments(picture[y : y + h, x : x + w])
        if moments["m00"] <= 0:
            return None
        place = np.array([moments["m10"], moments["m01"]]) / moments["m00"] + (left + x, top + y)
        variances = np.array([moments["mu20"], moments["mu02"]]) / moments["m00"] + 1 / 12  # pixels are unit squares
        width, height = (4 * np.sqrt(np.maximum(variances, 1 / 12))).tolist()
        return place, (width, height)
