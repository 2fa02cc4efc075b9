"""`cascade_pf`: the particle filter on grey levels and then velocity of Xue, Yuan and Xie 2011."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Floats
from irtrack.filters import particle as cloud
from irtrack.filters.resampling import RESAMPLERS
from irtrack.trackers.grey_velocity import Cue, GreyVelocityPart


class CascadePF(GreyVelocityPart):
    """Two layers of particles on the high-passed frame: drawn by grey levels, then weighed by velocity.

    M. Xue, G. Yuan, K. Xie, "Integrating gray and velocity cue for infrared small target tracking",
    J. Image and Graphics 16(5), 2011, Algorithm 2; see `irtrack.trackers.grey_velocity` for what it
    leaves open. Section 4 takes 30 and 15 particles before the sky, 40 and 20 before the ground.
    """

    source: ClassVar[str] = "Xue, Yuan, Xie 2011"

    n1: int = Field(default=30, ge=2, le=100_000)
    """N1, particles of the first layer (section 4: 30 or 40)."""
    n2: int = Field(default=15, ge=2, le=100_000)
    """N2, particles of the second (15 or 20)."""

    def _drawn(self) -> int:
        return self.n1

    def _layered(self, positions: Floats, grey: Floats, cue: Cue, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Algorithm 2, step 4: N2 of the N1 drawn by their grey weights, then weighed by eq. 7 alone."""
        chosen = positions.take(RESAMPLERS[self.resampling](grey, rng, self.n2), axis=0)
        return chosen, cloud.normalised(cue(chosen))
