"""A target's path through a stage, its velocity and acceleration; what a posture is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.motion.base import Path
from irsim.types import Floats

SMOOTHED_S = 0.5
"""Seconds to each side over which velocity and acceleration of all but arrows and aeroplanes are fitted: about as
long as a multirotor takes to tilt from level flight into a brake. A steady turn of 1 rad/s seems 2 % weaker for it;
places with 5 cm of white noise tilt a multirotor by 0.6 degrees."""

_SAMPLES = np.linspace(-SMOOTHED_S, SMOOTHED_S, 11)
"""Seconds around a moment at which a parabola is fitted to the path."""


@dataclass(frozen=True)
class Way:
    """A target's path through a stage; `name` is the target's id, which addresses the path's randomness."""

    path: Path
    context: SceneContext
    name: str

    def positions(self, frames: Floats) -> Floats:
        """(n, 3) m, first camera frame, at frame numbers (n,)."""
        return self.path.positions(frames, self.context, self.name)

    @property
    def axes(self) -> Floats:
        """(3, 3) columns right, ahead (both level) and up, as vectors of the first camera frame."""
        right, down = np.array([1.0, 0.0, 0.0]), self.context.geometry.down
        return np.stack([right, np.cross(right, down), -down], axis=-1)

    def motion(self, frames: Floats) -> tuple[Floats, Floats]:
        """(n, 3) m/s and (n, 3) m/s2 along `axes`: of the parabola through SMOOTHED_S to both sides, least squares."""
        around = np.add.outer(_SAMPLES * self.context.rate_hz, frames)
        places = self.positions(around.ravel()).reshape(len(_SAMPLES), len(frames), 3)
        bent = _SAMPLES**2 - np.mean(_SAMPLES**2)
        velocity = _weighed(places, _SAMPLES / np.sum(_SAMPLES**2))
        acceleration = _weighed(places, 2 * bent / np.sum(bent**2))
        return self._along_axes(velocity), self._along_axes(acceleration)

    def _along_axes(self, vectors: Floats) -> Floats:
        return np.asarray(np.sum(vectors[:, :, None] * self.axes, axis=1))


class Posture(ABC):
    """The law by which a body's attitude follows from its path alone, the same for any frames asked for."""

    @abstractmethod
    def bodies(self, way: Way, frames: Floats) -> Floats:
        """(n, 3, 3): body to first camera vectors at frame numbers (n,), which may be fractional."""


def _weighed(places: Floats, weights: Floats) -> Floats:
    """(n, 3) sums of places (k, n, 3) by weights (k,); a matrix product's last bits would go with n."""
    return np.asarray(np.sum(places * weights[:, None, None], axis=0))
