"""`mean_shift_pf`: particles that climb by mean shift before they are weighed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame
from irtrack.filters import particle as cloud
from irtrack.filters.motion import random_walk, random_walk_density
from irtrack.filters.resampling import RESAMPLERS
from irtrack.trackers.base import Deviation, Sight
from irtrack.trackers.grey import Appearance, Seen, weigh
from irtrack.trackers.shifting import ShiftPart
from irtrack.trackers.walk import WalkPart
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class MeanShiftPFState:
    """positions (N, 2) px, weights (N,); center (2,) px of the last estimate."""

    appearance: Appearance
    reference: Floats
    positions: Floats
    weights: Floats
    center: Floats
    sight: Sight


class MeanShiftPF(ShiftPart, WalkPart):
    """Particles that walk at random, climb by mean shift, and are weighed by their grey histogram.

    K. Wei, Y. Zhao, Q. Pan, et al., "IR target tracking based on mean shift and particle filter",
    J. Optoelectronics Laser 19(2), 2008, as Xue et al. 2011 tell and measure it (reference 8; section
    4: 45 or 60 particles, 32 bins, Epanechnikov kernel, radius 10). The rest is open; what Xue et al.
    print for their own filter is taken (sigma, update). The original works on the frame itself, and
    Xue's comparison with it is confounded by the high-pass: switch it on here as well.

    A particle that climbed is no draw from the motion model any more, and a weight by likeness alone
    favours what can be climbed. `corrected`: climbed particles are scattered by `jitter`, and weighed
    by likeness times the density that the motion model gives their place over that of the climbed
    cloud, both as mixtures over all particles.
    """

    source: ClassVar[str] = "Wei, Zhao, Pan, Zhang 2008"

    particles: int = Field(default=45, ge=2, le=1000)
    """N (section 4 of Xue et al.: 45 or 60)."""
    corrected: bool = False
    """Whether weights make up for the climb."""
    jitter: Deviation = 1.0
    """corrected: deviation of the scatter after a climb, px."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftPFState:
        """The reference histogram, and a cloud on the box's centre."""
        appearance, reference = self.look(frame, box)
        center = np.array([box.cx, box.cy])
        return MeanShiftPFState(appearance, reference, center[None], np.ones(1), center, Sight())

    def step(
        self, state: MeanShiftPFState, frame: Frame, rng: np.random.Generator
    ) -> tuple[MeanShiftPFState, Estimate]:
        """Draw, spread, climb, weigh, estimate, update the reference."""
        appearance = state.appearance
        picture = appearance.picture(frame)
        start = state.positions.take(RESAMPLERS[self.resampling](state.weights, rng, self.particles), axis=0)
        spread = random_walk(start, self.radius, self.propagation, rng)
        positions = self.climbed(appearance, picture, spread, state.reference).centers
        climbed = positions
        if self.corrected:
            positions = positions + self.jitter * rng.standard_normal(positions.shape)
        rho, visible = appearance.likeness(picture, positions, state.reference)
        weights, in_view = weigh(rho, visible, 1 / (2 * self.sigma_grey**2))
        if self.corrected and in_view:
            weights = self._made_up_for(weights, positions, start, climbed)

        center = cloud.mean(weights, positions)
        judged = appearance.judge(picture, (float(center[0]), float(center[1])), state.reference)
        sight = self.sight_after(state.sight, judged, in_view)
        after = replace(
            state,
            reference=self.updated(state.reference, judged, sight),
            positions=positions,
            weights=weights,
            center=center,
            sight=sight,
        )
        seen = Seen(appearance, judged, sight, in_view)
        return after, self.of_cloud(seen, positions, weights, center, center - state.center)

    def _made_up_for(self, weights: Floats, positions: Floats, start: Floats, climbed: Floats) -> Floats:
        """Weights (N,) times prior over proposal; as they were where no place can be reached by the model."""
        prior = random_walk_density(positions, start, self.radius, self.propagation)
        proposal = random_walk_density(positions, climbed, 3 * self.jitter, "gaussian")
        made_up_for = cloud.shares(weights * prior / proposal)
        return weights if made_up_for is None else made_up_for
