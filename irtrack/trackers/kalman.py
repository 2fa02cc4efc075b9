"""Kalman filters on measured positions of a target: `kalman` and `ekf`, and the gated filter on which they build."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, pi, sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.centroid import centroid, contrast
from irtrack.features.correlation import Patch
from irtrack.features.histogram import LocalBackground, epanechnikov_kernel
from irtrack.features.mean_shift import Bandwidth, bandwidth, kernel_histogram, mean_shift
from irtrack.features.quantiser import Quantiser, fitted_range
from irtrack.features.window import Window, region
from irtrack.filters import kalman
from irtrack.filters.motion import constant_velocity, coordinated_turn, turn_noise
from irtrack.trackers.base import (
    Deviation,
    Footage,
    MonitoredTracker,
    Ratio,
    Spread,
    TrackerPart,
    VisibilityMonitor,
    footage,
    start_window,
)
from irtrack.types import Estimate, Status

BINS = 32
"""Number of grey levels of the mean-shift histogram, as in Cheng et al. 2006, section 3."""
FASTEST_TURN = pi / 2
"""Largest turn rate, rad/frame; larger values are noise."""


class GatedKalman(TrackerPart):
    """Mixin of Gaussian filters of the target's motion, updated by measured positions (x, y) px within a gate.

    The mean (n,) holds x, y px, vx, vy px/frame, then further quantities of the motion; its covariance is (n, n). The
    gate is the chi-square region of the predicted measurement (Bar-Shalom et al. 2001, section 2.3.2).
    """

    acceleration: Deviation = 0.5
    """Standard deviation of the acceleration on each axis, px/frame^2."""
    measurement_sd: Deviation = 1.0
    """Standard deviation of the measured place on each axis, px."""
    start_speed_sd: Spread = 3.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    gate: Ratio = 13.8
    """Largest squared Mahalanobis distance of a measurement; chi-square, 2 degrees: 99.9 %."""

    def start(self, box: Box) -> tuple[Floats, Floats]:
        """Return mean (4,) and covariance (4, 4) in the first frame: at the box's centre, with velocity 0."""
        variances = [self.measurement_sd**2] * 2 + [self.start_speed_sd**2] * 2
        return np.array([box.cx, box.cy, 0.0, 0.0]), np.diag(variances)

    def predict(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        """Return mean and covariance a frame ahead, by velocity and white-noise acceleration (Bar-Shalom et al. 2001,
        section 6.3.2)."""
        return kalman.predict(mean, covariance, *constant_velocity(self.acceleration))

    def within_gate(self, mean: Floats, covariance: Floats, place: Floats) -> bool:
        """Return whether a measured position (2,) px is within the gate around the predicted one."""
        return kalman.squared_distance(*kalman.innovation(mean, covariance, place, *self._measured(mean))) <= self.gate

    def updated(self, mean: Floats, covariance: Floats, place: Floats) -> tuple[Floats, Floats]:
        """Return mean and covariance after a measured position (2,) px."""
        return kalman.update(mean, covariance, place, *self._measured(mean))

    def _measured(self, mean: Floats) -> tuple[Floats, Floats]:
        """Return the measurement matrix H (2, n) of the position, and the measurement noise R (2, 2) px^2."""
        return np.eye(2, len(mean)), self.measurement_sd**2 * np.eye(2)


def kalman_estimate(
    mean: Floats, covariance: Floats, size: tuple[float, float], status: Status, score: float | None
) -> Estimate:
    """Return the estimate of a filter's mean (n,) and covariance (n, n), of a target of `size` (w, h) px."""
    x, y, vx, vy = mean[:4].tolist()
    return Estimate(
        center=(x, y), size=size, status=status, score=score, velocity=(vx, vy), covariance=covariance[:2, :2]
    )


@dataclass(frozen=True, slots=True, eq=False)
class GreyReference:
    """Grey histograms of the target: one by the kernel of mean shift, one of the window with its local background."""

    levels: Quantiser
    reference: Floats
    h: Bandwidth
    background: LocalBackground
    window_histogram: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Description of the target in the first frame, with a field for each kind of measurement.

    contrast  counts, for centroid;  patch  for ncc, and its window also for centroid;  grey  for mean_shift

    `updated` blends the patch; the others stay as in the first frame.
    """

    footage: Footage
    size: tuple[float, float]
    contrast: float
    patch: Patch
    grey: GreyReference

    @classmethod
    def of(cls, frame: Frame, box: Box) -> Target:
        """Return the description of a box; InputError where it does not meet the frame, or is invalid."""
        window, corner = start_window(frame, box)
        pixels, center, reach = window.cut(frame.image, corner), (box.cx, box.cy), (window.columns, window.rows)
        levels = fitted_range(frame.image, pixels, BINS)
        whole = Window.of(box)
        margin = (ceil(whole.columns / 2), ceil(whole.rows / 2))
        background = LocalBackground.of(whole, epanechnikov_kernel(whole), margin, levels)
        return cls(
            footage=footage(frame),
            size=(box.w, box.h),
            contrast=contrast(pixels, region(frame.image, window, corner, reach)[2]),
            patch=Patch.of(frame.image, window, corner, reach),
            grey=GreyReference(
                levels=levels,
                reference=kernel_histogram(frame.image, center, bandwidth(box), levels)[0],
                h=bandwidth(box),
                background=background,
                window_histogram=background.histograms(frame.image, center)[0][0],
            ),
        )

    def updated(self, image: Image, place: tuple[float, float], rate: float) -> Target:
        """Return the target whose patch is blended with the share `rate` of the patch at a place (x, y) px."""
        return replace(self, patch=self.patch.blended(image, place, rate))


@dataclass(frozen=True, slots=True, eq=False)
class KalmanState:
    """State: mean (n,), x, y px, vx, vy px/frame, then further quantities of the motion; its covariance (n, n)."""

    target: Target
    mean: Floats
    covariance: Floats
    monitor: VisibilityMonitor


Measured = tuple[tuple[float, float] | None, float | None, VisibilityMonitor]
"""Measured position, None where the target was not found; its score; the monitor after the measurement."""


class PositionFilter(GatedKalman, MonitoredTracker):
    """Base of Gaussian filters with one of three measurements; where no measurement is in the gate, the prediction is
    kept."""

    acceleration: Deviation = 0.3
    """Standard deviation of the acceleration on each axis, px/frame^2. Found by search on development seeds: it has the
    least mean cost over `kalman` with its three measurements and `ekf`."""
    measurement: Literal["centroid", "ncc", "mean_shift"] = "centroid"
    """Measurement of the target's place: the centroid of pixels above a threshold, the best match of the first
    patch, or the mode of similarity that mean shift reaches from the predicted place."""
    threshold: Fraction = 0.5
    """centroid: share of the target's contrast in the first frame that a pixel must exceed."""
    update: Fraction = 0.02
    """ncc: share of the patch at a measured place that enters the reference patch; 0: the first patch stays. Found by
    search on development seeds."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> KalmanState:
        """Return the state at the box's centre, with velocity 0 of standard deviation `start_speed_sd`."""
        return KalmanState(Target.of(frame, box), *self.start(box), VisibilityMonitor())

    def step(self, state: KalmanState, frame: Frame, rng: np.random.Generator) -> tuple[KalmanState, Estimate]:
        """Predict, measure within the gate, update."""
        target = state.target
        target.footage.check(frame)
        mean, covariance = self.predict(state.mean, state.covariance)
        variance = np.diag(covariance)[:2] + self.measurement_sd**2
        measured, score, monitor = self._measure(state, frame.image, mean, variance)
        if measured is not None:
            place = np.array(measured)
            if self.within_gate(mean, covariance, place):
                mean, covariance = self.updated(mean, covariance, place)
                if self.update > 0 and self.measurement == "ncc":
                    target = target.updated(frame.image, measured, self.update)
            else:
                monitor = state.monitor.miss()
        after = replace(state, target=target, mean=mean, covariance=covariance, monitor=monitor)
        return after, kalman_estimate(mean, covariance, target.size, monitor.status(self.lost_after), score)

    def _measure(self, state: KalmanState, image: Image, mean: Floats, variance: Floats) -> Measured:
        target = state.target
        if self.measurement == "mean_shift":
            return self._mode(target.grey, state.monitor, image, mean)
        predicted = float(mean[0]), float(mean[1])
        gate = [ceil(min(sqrt(self.gate * v), max(image.shape))) for v in variance.tolist()]
        if self.measurement == "centroid":
            # At least twice the target's size, so that the region's median is the background's level.
            window = target.patch.window
            reach = (max(gate[0], ceil(window.columns / 2)), max(gate[1], ceil(window.rows / 2)))
            left, top, pixels = region(image, window, window.corner(predicted), reach)
            found = centroid(pixels, target.contrast, self.threshold)
            if found is None:
                return None, None, state.monitor.miss()
            return (left + found[0], top + found[1]), None, state.monitor.hit()
        place, score = target.patch.search(image, predicted, (gate[0], gate[1]))
        monitor = state.monitor.after(score, target.patch.distractor, self.seen)
        return (place if monitor.misses == 0 else None), score, monitor

    def _mode(self, grey: GreyReference, monitor: VisibilityMonitor, image: Image, mean: Floats) -> Measured:
        modes = mean_shift(image, mean[None, :2], grey.h, grey.levels, grey.reference)
        if modes.visible[0] == 0:
            return None, 0.0, monitor.miss()
        x, y = modes.centers[0].tolist()
        match = grey.background.score(image, (x, y), grey.window_histogram)
        monitor = monitor.after(match.score, match.background_score, self.seen)
        return ((x, y) if monitor.misses == 0 else None), match.score, monitor


class Kalman(PositionFilter):
    """Constant-velocity Kalman filter, measured by a centroid in a gate, by correlation, or by mean shift.

    The baseline of J. Cheng et al. 2006, section 3 (their references 3, 4), who only name it. Chosen here: white-noise
    acceleration (Bar-Shalom et al. 2001, section 6.3.2) and a choice of three measurements, since the measurement
    decides the filter's accuracy.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bar-Shalom, Li, Kirubarajan 2001"


class EKF(PositionFilter):
    """Extended Kalman filter of a target at constant speed with a wandering turn rate.

    A baseline of J. Cheng et al. 2006, section 3, who only name it. Chosen here: the nearly coordinated turn of
    Bar-Shalom, Li, Kirubarajan 2001, section 11.7, linearised once a frame; the measurements are those of `kalman`.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bar-Shalom, Li, Kirubarajan 2001"

    turn_sd: Annotated[float, Field(ge=0, le=1)] = 0.02
    """Standard deviation of the change of the turn rate, rad/frame a frame."""
    start_turn_sd: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Standard deviation of the unknown first turn rate, rad/frame."""

    def start(self, box: Box) -> tuple[Floats, Floats]:
        """Return mean (5,) and covariance (5, 5) in the first frame: those of constant velocity, without a turn."""
        mean, covariance = super().start(box)
        return np.append(mean, 0.0), np.diag([*np.diag(covariance), self.start_turn_sd**2])

    def predict(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        """Return mean and covariance a frame ahead along the circle: F P F' + Q, F the Jacobian at the mean."""
        bounded = np.array([*mean[:4], np.clip(mean[4], -FASTEST_TURN, FASTEST_TURN)])
        moved, F = coordinated_turn(bounded)
        return moved, F @ covariance @ F.T + turn_noise(self.acceleration, self.turn_sd)
