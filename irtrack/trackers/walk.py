"""What the particle filters share whose particles walk at random and are weighed by grey levels."""

from __future__ import annotations

from typing import Literal

from irsim.config.quantities import Fraction
from irsim.types import Floats
from irtrack.features.histogram import Judged
from irtrack.filters.motion import Propagation
from irtrack.filters.resampling import Resampling
from irtrack.trackers.base import Deviation, Ratio, Sight
from irtrack.trackers.grey import GreyPart, blend


class WalkPart(GreyPart):
    """A tracker whose particles spread about their places and are weighed by exp(-(1 - rho) / (2 sigma^2))."""

    kernel: Literal["gaussian", "epanechnikov"] = "epanechnikov"
    """k of the histogram (Xue et al. 2011, section 4: Epanechnikov, eq. 2, with half the sizes on each axis);
    gaussian: as Cheng et al. 2006, eq. 6."""
    sigma_grey: Ratio = 0.15
    """sigma of Xue et al. 2011, eq. 5; no value is printed."""
    radius: Deviation = 10.0
    """Radius of the particles' spread, px (section 4: 10)."""
    propagation: Propagation = "gaussian"
    """Spread over the disc of that radius: normal, the radius being three deviations, or even."""
    resampling: Resampling = "multinomial"
    """How particles are drawn (the sources do not say)."""
    update: Literal["always", "seen", "never"] = "always"
    """When the reference follows the target (Xue et al. 2011, Algorithm 2, step 6: always)."""
    lam: Fraction = 0.9
    """lambda of that step, what is kept of the reference (0.9)."""

    def updated(self, reference: Floats, judged: Judged, sight: Sight) -> Floats:
        """q <- lambda q + (1 - lambda) q(estimate), (bins,)."""
        follows = self.update == "always" or (self.update == "seen" and sight.missed == 0)
        return blend(reference, judged, 1 - self.lam) if follows else reference
