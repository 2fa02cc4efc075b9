"""`ekf`: an extended Kalman filter on the coordinated turn."""

from __future__ import annotations

from math import pi
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats
from irtrack.filters.turn import coordinated_turn, turn_noise
from irtrack.trackers.place import PlacePart

FASTEST = pi / 2
"""rad/frame. A turn rate beyond it is no turn but noise: at a quarter turn a frame, left is not told from right."""


class EKF(PlacePart):
    """Extended Kalman filter whose target flies at constant speed and turns at a rate that wanders.

    A baseline of J. Cheng et al. 2006, section 3, of which they give only the name. Here: the nearly
    coordinated turn of Bar-Shalom, Li, Kirubarajan 2001, section 11.7, linearised once a frame; the
    measurements are those of `kalman`.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bar-Shalom, Li, Kirubarajan 2001"

    turn_sd: Annotated[float, Field(ge=0, le=1)] = 0.02
    """Standard deviation of the change of the turn rate, rad/frame a frame."""
    start_turn_sd: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Standard deviation of the unknown first turn rate, rad/frame."""

    def start(self, box: Box) -> tuple[Floats, Floats]:
        """Mean (5,) and covariance (5, 5) in the first frame: those of constant velocity, and no turn."""
        mean, covariance = super().start(box)
        return np.append(mean, 0.0), np.diag([*np.diag(covariance), self.start_turn_sd**2])

    def predict(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        """On along its circle: F P F' + Q, F the Jacobian at the mean."""
        bounded = np.array([*mean[:4], np.clip(mean[4], -FASTEST, FASTEST)])
        moved, F = coordinated_turn(bounded)
        return moved, F @ covariance @ F.T + turn_noise(self.acceleration, self.turn_sd)
