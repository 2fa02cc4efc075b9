"""What the Kalman trackers share: constant velocity, and a gate for the places they measure."""

from __future__ import annotations

import numpy as np

from irsim.types import Box, Floats
from irtrack.filters import kalman as filter
from irtrack.filters.motion import constant_velocity
from irtrack.trackers.base import Deviation, Ratio, Spread, TrackerPart
from irtrack.types import Estimate, Status


class GatedPart(TrackerPart):
    """A Gaussian filter of the target's motion, measured by its place (x, y) px.

    The mean (n,) holds x, y px, vx, vy px/frame, then what the motion needs besides; its covariance is (n, n). The
    gate is the chi-square region of the predicted measurement (Bar-Shalom et al. 2001, section 2.3.2).
    """

    acceleration: Deviation = 0.5
    """Standard deviation of the acceleration on each axis, px/frame^2."""
    measurement_sd: Deviation = 1.0
    """Standard deviation of the measured place on each axis, px."""
    start_speed_sd: Spread = 3.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    gate: Ratio = 13.8
    """Squared Mahalanobis distance that a measurement may have; chi-square, 2 degrees: 99.9 %."""

    def start(self, box: Box) -> tuple[Floats, Floats]:
        """Mean (4,) and covariance (4, 4) in the first frame: in the box's centre, at rest within `start_speed_sd`."""
        variances = [self.measurement_sd**2] * 2 + [self.start_speed_sd**2] * 2
        return np.array([box.cx, box.cy, 0.0, 0.0]), np.diag(variances)

    def predict(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        """Mean and covariance a frame on, by the velocity and white-noise acceleration (section 6.3.2 there)."""
        return filter.predict(mean, covariance, *constant_velocity(self.acceleration))

    def within_gate(self, mean: Floats, covariance: Floats, place: Floats) -> bool:
        """Whether a place (2,) px is near enough to the predicted one to be the target's."""
        return filter.distance2(*filter.innovation(mean, covariance, place, *self._measured(mean))) <= self.gate

    def update(self, mean: Floats, covariance: Floats, place: Floats) -> tuple[Floats, Floats]:
        """Mean and covariance after the target was measured at a place (2,) px."""
        return filter.update(mean, covariance, place, *self._measured(mean))

    def _measured(self, mean: Floats) -> tuple[Floats, Floats]:
        """H (2, n), which takes the place from the mean, and R (2, 2) px^2, the measurement's noise."""
        return np.eye(2, len(mean)), self.measurement_sd**2 * np.eye(2)


def filtered(
    mean: Floats, covariance: Floats, size: tuple[float, float], status: Status, score: float | None
) -> Estimate:
    """What is said of a target of `size` (w, h) px by the filter's mean (n,) and covariance (n, n)."""
    x, y, vx, vy = mean[:4].tolist()
    return Estimate(
        center=(x, y), size=size, status=status, score=score, velocity=(vx, vy), covariance=covariance[:2, :2]
    )
