"""`kalman`: a constant-velocity Kalman filter on one plain measurement of the target's place."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from irsim.types import Box, Floats
from irtrack.filters import kalman as filter
from irtrack.filters.motion import constant_velocity
from irtrack.trackers.place import PlacePart


class Kalman(PlacePart):
    """Constant-velocity Kalman filter, measured by a centroid in a gate, by correlation, or by mean shift.

    The baseline of J. Cheng et al. 2006, section 3 (their references 3, 4), which leave everything
    open but the name. Here: white-noise acceleration (Bar-Shalom et al. 2001, section 6.3.2), and
    three measurements to choose from, since what is measured decides how well the filter does: a
    centroid alone would be a straw man.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bar-Shalom, Li, Kirubarajan 2001"

    def start(self, box: Box) -> tuple[Floats, Floats]:
        """(4,) at rest in the box's centre, and (4, 4)."""
        variances = [self.measurement_sd**2] * 2 + [self.start_speed_sd**2] * 2
        return np.array([box.cx, box.cy, 0.0, 0.0]), np.diag(variances)

    def predict(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        """On by its velocity."""
        return filter.predict(mean, covariance, *constant_velocity(self.acceleration))
