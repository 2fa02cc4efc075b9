"""`kalman`: a constant-velocity Kalman filter on one plain measurement of the target's place."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.kinds import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.centroid import centroid, contrast
from irtrack.features.correlation import ncc, peak, rival
from irtrack.features.window import Window, region
from irtrack.filters import kalman as filter
from irtrack.filters.motion import constant_velocity
from irtrack.trackers.base import Deviation, Footage, Ratio, Sight, Spread, TrackerPart, footage, start_window
from irtrack.types import Estimate

_H = np.eye(2, 4)


@dataclass(frozen=True, slots=True, eq=False)
class KalmanState:
    """mean (4,) = x, y px, vx, vy px/frame, and its covariance; template, floor for ncc; contrast for centroid."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    mean: Floats
    covariance: Floats
    template: Floats
    floor: float
    contrast: float
    sight: Sight


class Kalman(TrackerPart):
    """Constant-velocity Kalman filter, measured by a centroid in a gate or by correlation.

    The baseline of J. Cheng et al. 2006, section 3 (their references 3, 4), which leave everything
    open but the name. Here: white-noise acceleration (Bar-Shalom et al. 2001, section 6.3.2); the
    gate is the chi-square region of the predicted measurement (section 2.3.2 there); a measurement
    beyond it, or none, leaves the prediction to stand. Two measurements: `centroid` of what passes
    half the target's first contrast, and `ncc`, the best match of the first patch. A centroid alone
    would be a straw man.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bar-Shalom, Li, Kirubarajan 2001"

    measurement: Literal["centroid", "ncc"] = "centroid"
    """What gives the target's place in a frame."""
    acceleration: Deviation = 0.5
    """Standard deviation of the acceleration on each axis, px/frame^2."""
    measurement_sd: Deviation = 1.0
    """Standard deviation of the measured place on each axis, px."""
    start_speed_sd: Spread = 3.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    gate: Ratio = 13.8
    """Squared Mahalanobis distance that a measurement may have; chi-square, 2 degrees: 99.9 %."""
    threshold: Fraction = 0.5
    """centroid: share of the target's first contrast that a pixel must pass."""
    seen: Fraction = 0.5
    """ncc: share of the way from the best false match's score to the target's usual one that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without a measurement after which the status is lost."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> KalmanState:
        """At the box's centre, at rest within `start_speed_sd`."""
        window, corner = start_window(frame, box)
        patch = window.cut(frame.image, corner)
        template = patch.astype(np.float64)
        left, top, around = region(frame.image, window, corner, (window.columns, window.rows))
        floor = rival(ncc(around, template), (corner[0] - left, corner[1] - top), window)
        return KalmanState(
            footage=footage(frame),
            size=(box.w, box.h),
            window=window,
            mean=np.array([box.cx, box.cy, 0.0, 0.0]),
            covariance=np.diag([self.measurement_sd**2] * 2 + [self.start_speed_sd**2] * 2),
            template=template,
            floor=floor,
            contrast=contrast(patch, around),
            sight=Sight(),
        )

    def step(self, state: KalmanState, frame: Frame, rng: np.random.Generator) -> tuple[KalmanState, Estimate]:
        """Predict, measure within the gate, update."""
        state.footage.check(frame)
        mean, covariance = filter.predict(state.mean, state.covariance, *constant_velocity(self.acceleration))
        R = self.measurement_sd**2 * np.eye(2)
        measured, score, sight = self._measure(state, frame.image, mean, np.diag(covariance[:2, :2] + R))
        if measured is not None:
            nu, S = filter.innovation(mean, covariance, np.array(measured), _H, R)
            if filter.distance2(nu, S) <= self.gate:
                mean, covariance = filter.update(mean, covariance, np.array(measured), _H, R)
            else:
                sight = state.sight.unseen()
        after = KalmanState(
            footage=state.footage,
            size=state.size,
            window=state.window,
            mean=mean,
            covariance=covariance,
            template=state.template,
            floor=state.floor,
            contrast=state.contrast,
            sight=sight,
        )
        x, y, vx, vy = mean.tolist()
        return after, Estimate(
            center=(x, y),
            size=state.size,
            status=sight.status(self.lost_after),
            score=score,
            velocity=(vx, vy),
            covariance=covariance[:2, :2],
        )

    def _measure(
        self, state: KalmanState, image: Image, mean: Floats, variance: Floats
    ) -> tuple[tuple[float, float] | None, float | None, Sight]:
        """The place measured about the prediction (None: not seen), its score, and the sight after it."""
        window, corner = state.window, state.window.corner((float(mean[0]), float(mean[1])))
        gate = [ceil(min(sqrt(self.gate * v), max(image.shape))) for v in variance.tolist()]
        if self.measurement == "centroid":
            # At least twice the target's size, so that the region's median is the background's level.
            reach = (max(gate[0], ceil(window.columns / 2)), max(gate[1], ceil(window.rows / 2)))
            left, top, pixels = region(image, window, corner, reach)
            found = centroid(pixels, state.contrast, self.threshold)
            if found is None:
                return None, None, state.sight.unseen()
            return (left + found[0], top + found[1]), None, state.sight.seen()
        left, top, pixels = region(image, window, corner, (gate[0], gate[1]))
        (x, y), score = peak(ncc(pixels, state.template))
        sight = state.sight.after(score, state.floor, self.seen)
        return (window.center((left + x, top + y)) if sight.missed == 0 else None), score, sight
