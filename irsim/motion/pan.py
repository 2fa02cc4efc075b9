"""A camera that turns evenly."""

from __future__ import annotations

import numpy as np

from irsim.config.quantities import Turning
from irsim.geometry.context import SceneContext
from irsim.motion.base import Pointing
from irsim.types import Floats


class Pan(Pointing):
    """A steady turn from frame 0 on."""

    azimuth_deg_s: Turning = 0.0
    """To the right, degrees a second."""
    elevation_deg_s: Turning = 0.0
    """Upwards, degrees a second."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        rates = np.radians([self.azimuth_deg_s, self.elevation_deg_s, 0.0])
        return np.asarray(frames)[:, None] / context.rate_hz * rates
