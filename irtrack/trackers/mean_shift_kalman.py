"""`mean_shift_kalman`: mean shift as the measurement of a Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.trackers.base import Sight
from irtrack.trackers.gated import GatedPart, filtered
from irtrack.trackers.grey import Appearance, blend
from irtrack.trackers.shifting import ShiftPart
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class MeanShiftKalmanState:
    """mean (4,) = x, y px, vx, vy px/frame, and its covariance (4, 4)."""

    appearance: Appearance
    reference: Floats
    mean: Floats
    covariance: Floats
    sight: Sight


class MeanShiftKalman(ShiftPart, GatedPart):
    """Constant-velocity Kalman filter whose measurement climbs by mean shift from the predicted place.

    R. Xu, L. Yang, "Small target tracking approach combined the merits of two tracking frameworks
    under infrared complex background", J. Infrared Millim. Waves 27(5), 2008, as Xue et al. 2011
    (reference 5) tell it: a kernel-weighted grey histogram, measured by mean shift, filtered over time
    by Kalman. The rest is open. Here: white-noise acceleration (Bar-Shalom et al. 2001, eq. 6.3.2-4);
    a place that does not look like the target, or lies beyond the gate (section 2.3.2 there), is no
    measurement, and the prediction stands, so that a hidden target is waited for on its way.
    """

    source: ClassVar[str] = "Xu, Yang 2008"

    alpha: Fraction = 0.0
    """Share of the measured place's histogram that enters the reference where the target is seen."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftKalmanState:
        """At the box's centre, at rest within `start_speed_sd`."""
        appearance, reference = self.look(frame, box)
        return MeanShiftKalmanState(appearance, reference, *self.start(box), Sight())

    def step(
        self, state: MeanShiftKalmanState, frame: Frame, rng: np.random.Generator
    ) -> tuple[MeanShiftKalmanState, Estimate]:
        """Predict, climb from there, update by where the climb ended."""
        appearance, reference = state.appearance, state.reference
        picture = appearance.picture(frame)
        mean, covariance = self.predict(state.mean, state.covariance)
        shifted = self.climbed(appearance, picture, mean[None, :2], reference)
        measured, in_view = shifted.centers[0], bool(shifted.visible[0] > 0)
        judged = appearance.judge(picture, (float(measured[0]), float(measured[1])), reference)
        gated = in_view and self.within_gate(mean, covariance, measured)
        sight = self.sight_after(state.sight, judged, gated)
        if sight.missed == 0:
            mean, covariance = self.update(mean, covariance, measured)
            reference = blend(reference, judged, self.alpha)
        after = replace(state, reference=reference, mean=mean, covariance=covariance, sight=sight)
        status = sight.status(self.lost_after) if in_view else "lost"
        return after, filtered(mean, covariance, appearance.size, status, judged.score)
