"""`mean_shift`: a window that climbs to the grey levels most like the target's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.trackers.base import Sight
from irtrack.trackers.grey import Appearance, blend
from irtrack.trackers.shifting import ShiftPart
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class MeanShiftState:
    """center (2,) px of the last estimate."""

    appearance: Appearance
    reference: Floats
    center: Floats
    sight: Sight


class MeanShift(ShiftPart):
    """Mean shift on the kernel-weighted grey histogram, from the last place in each frame.

    The baseline of J. Cheng et al. 2006 (their reference 5: J. Cheng, J. Yang, J. Infrared Millim.
    Waves 24(3), 2005), after D. Comaniciu, V. Ramesh, P. Meer, IEEE TPAMI 25(5), 2003. Cheng and Yang
    work in a "cascade grey space", of which the sources here say no more than the name: plain grey
    levels, or the high-passed frame. There is no motion model: a target must overlap its last window.
    """

    source: ClassVar[str] = "Cheng, Yang 2005; Comaniciu, Ramesh, Meer 2003"

    alpha: Fraction = 0.0
    """Share of the estimate's histogram that enters the reference where the target is seen; 0: Comaniciu's."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftState:
        """The reference histogram, at the box's centre."""
        appearance, reference = self.look(frame, box)
        return MeanShiftState(appearance, reference, np.array([box.cx, box.cy]), Sight())

    def step(self, state: MeanShiftState, frame: Frame, rng: np.random.Generator) -> tuple[MeanShiftState, Estimate]:
        """Climb from the last place."""
        appearance = state.appearance
        picture = appearance.picture(frame)
        shifted = self.climbed(appearance, picture, state.center[None], state.reference)
        center, in_view = shifted.centers[0], bool(shifted.visible[0] > 0)
        x, y = center.tolist()
        judged = appearance.judge(picture, (x, y), state.reference)
        sight = self.sight_after(state.sight, judged, in_view)
        reference = blend(state.reference, judged, self.alpha) if sight.missed == 0 else state.reference
        vx, vy = (center - state.center).tolist()
        return replace(state, reference=reference, center=center, sight=sight), Estimate(
            center=(x, y),
            size=appearance.size,
            status=sight.status(self.lost_after) if in_view else "lost",
            score=judged.score,
            velocity=(vx, vy),
        )
