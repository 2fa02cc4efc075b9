"""What the trackers on grey levels and velocity share, whether their cues come in turn or as a product."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame
from irtrack.features.velocity import line, velocity_likeness
from irtrack.filters import particle as cloud
from irtrack.filters.motion import random_walk
from irtrack.filters.resampling import RESAMPLERS
from irtrack.trackers.base import Deviation, Ratio, Sight
from irtrack.trackers.grey import Appearance, Seen, weigh
from irtrack.trackers.walk import WalkPart
from irtrack.types import Estimate

Cue = Callable[[Floats], Floats]
"""Places (N, 2) px to the logarithm of their likelihood (N,) by the target's velocity."""


@dataclass(frozen=True, slots=True, eq=False)
class GreyVelocityState:
    """positions (N, 2) px, weights (N,); trajectory, the last estimates (up to k, 2) px."""

    appearance: Appearance
    reference: Floats
    positions: Floats
    weights: Floats
    trajectory: Floats
    sight: Sight


class GreyVelocityPart(WalkPart):
    """A particle filter by grey levels and by velocity (Xue, Yuan, Xie 2011).

    What the paper leaves open, and what is chosen here: sigma of eq. 5 and 7; how particles spread
    ("radius 10": a normal deviation of a third of it, or a disc); the first cloud (all on the start
    box's centre); multinomial or other drawing; the high-pass (see `irtrack.features.highpass`).
    The velocity of the model, v_t of eq. 7, is that of the last k estimates; a particle's is that of
    the last k - 1 and itself.
    """

    high_pass: Literal["none", "ring", "full"] = "ring"
    """What histograms are taken of: the frame, or what it stands above a background predicted from a ring
    neighbourhood (eq. 1) or from a full one (its reference 12, Peng, Zhou 1999)."""
    cues: Literal["both", "grey", "velocity"] = "both"
    """Which likelihoods count: both, or one alone."""
    k: int = Field(default=5, ge=3, le=100)
    """Frames of the trajectory (section 3.1: 5, of 4 to 10); until there are so many, grey levels count alone."""
    velocity: Literal["lambda", "sqrt_lambda", "least_squares"] = "lambda"
    """The speed by the largest eigenvalue (Algorithm 1) or its root (section 2); or no eq. 6 at all, but the
    distance from where the least-squares line of the trajectory leads, by `place_sd`."""
    sigma_velocity: Ratio = 0.5
    """sigma of eq. 7. For slow targets the direction of a trajectory is mostly noise, so it must be wide."""
    place_sd: Deviation = 2.0
    """least_squares: deviation of the place from the line, px."""
    coast: bool = False
    """Whether an unseen target is taken to go on along the trajectory's line: the estimate is there, the particles
    keep to it as loosely as place_sd times the frames without sight, and grey levels do not count. The paper's
    filter knows no hiding."""
    carried: bool = False
    """Whether particles spread about where the trajectory's line leads from their place; the paper's stay."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> GreyVelocityState:
        """The reference histogram, and a cloud on the box's centre."""
        appearance, reference = self.look(frame, box)
        center = np.array([[box.cx, box.cy]])
        return GreyVelocityState(appearance, reference, center, np.ones(1), center, Sight())

    def step(
        self, state: GreyVelocityState, frame: Frame, rng: np.random.Generator
    ) -> tuple[GreyVelocityState, Estimate]:
        """Algorithm 2: draw, spread, weigh by the cues, estimate, update the reference."""
        appearance = state.appearance
        picture = appearance.view(frame)
        ahead, velocity = line(state.trajectory)
        start = state.positions.take(RESAMPLERS[self.resampling](state.weights, rng, self._drawn()), axis=0)
        positions = random_walk(start + velocity if self.carried else start, self.radius, self.propagation, rng)
        rho, visible = appearance.likeness(picture, positions, state.reference)
        grey, in_view = weigh(rho, visible, 0.0 if self.cues == "velocity" else 1 / (2 * self.sigma_grey**2))
        spread = positions
        known = len(state.trajectory) == self.k and self.cues != "grey" and in_view
        positions, weights = self._layered(spread, grey, self._cue(state, ahead), rng) if known else (spread, grey)
        center = cloud.mean(weights, positions)
        judged = appearance.judge(picture, (float(center[0]), float(center[1])), state.reference)
        sight = self.sight_after(state.sight, judged, in_view)
        if self.coast and known and sight.missed > 0:
            positions, center = spread, ahead
            weights = cloud.normalised(self._near(ahead, sight)(spread))
        trajectory = np.concatenate([state.trajectory, center[None]])[-self.k :]
        after = GreyVelocityState(
            appearance=appearance,
            reference=self.updated(state.reference, judged, sight),
            positions=positions,
            weights=weights,
            trajectory=trajectory,
            sight=sight,
        )
        seen = Seen(appearance, judged, sight, in_view)
        return after, self.of_cloud(seen, positions, weights, center, line(trajectory)[1])

    @abstractmethod
    def _drawn(self) -> int:
        """How many particles are drawn and weighed by their grey levels."""

    @abstractmethod
    def _layered(self, positions: Floats, grey: Floats, cue: Cue, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Places (n, 2) and weights (n,) after both cues, of places weighed by their grey levels."""

    def _cue(self, state: GreyVelocityState, ahead: Floats) -> Cue:
        if self.velocity == "least_squares":
            return self._near(ahead, state.sight)
        speed, trajectory = self.velocity, state.trajectory
        return lambda places: (velocity_likeness(trajectory, places, speed) - 1) / (2 * self.sigma_velocity**2)

    def _near(self, ahead: Floats, sight: Sight) -> Cue:
        """Places about where the line leads, the less closely the longer the target was not seen."""
        deviation = self.place_sd * (1 + sight.missed if self.coast else 1)
        return lambda places: -((places - ahead) ** 2).sum(axis=1) / (2 * deviation**2)
