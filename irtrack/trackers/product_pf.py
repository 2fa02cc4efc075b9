"""`product_pf`: grey levels and velocity as one product, what Xue, Yuan and Xie 2011 argue against."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Floats
from irtrack.filters import particle as cloud
from irtrack.trackers.grey_velocity import Cue, GreyVelocityPart

_NOTHING = float(np.finfo(np.float64).tiny)
"""Weight of a particle that sees nothing, for its logarithm."""


class ProductPF(GreyVelocityPart):
    """One layer of particles on the high-passed frame, weighed by grey levels times velocity.

    The "basic particle filter" that M. Xue, G. Yuan, K. Xie 2011, section 3.2, compare their cascade
    with: as dear at N = N1 + N2, and, they say, less robust. Both sample the same distribution; what
    differs is the spread of the estimate by chance.
    """

    source: ClassVar[str] = "Xue, Yuan, Xie 2011 (section 3.2)"

    particles: int = Field(default=45, ge=2, le=100_000)
    """N (section 3.2: N1 + N2, so 45 or 60)."""

    def _drawn(self) -> int:
        return self.particles

    def _layered(self, positions: Floats, grey: Floats, cue: Cue, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """The cues taken as independent: p(grey, velocity) = p(grey) p(velocity)."""
        return positions, cloud.normalised(np.log(np.maximum(grey, _NOTHING)) + cue(positions))
