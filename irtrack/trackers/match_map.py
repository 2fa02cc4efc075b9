"""Map of a target's match over the places in a gate, for proposals of particle filters."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np

from irsim.types import Floats
from irtrack.features.histogram import Picture
from irtrack.trackers.appearance import Appearance


@dataclass(frozen=True, slots=True, eq=False)
class MatchMap:
    """Bhattacharyya coefficients rho (G,) of windows at places (G, 2) px, a square lattice of side `side` px.

    rho is 0 outside the frame.
    """

    places: Floats
    rho: Floats
    side: float

    @classmethod
    def of(
        cls, appearance: Appearance, picture: Picture, center: Floats, reach: float, side: float, reference: Floats
    ) -> MatchMap:
        """Return the map of the square of half side `reach` px about a centre (2,) px."""
        count = floor(reach / side)
        steps = side * np.arange(-count, count + 1)
        x, y = np.meshgrid(center[0] + steps, center[1] + steps)
        places = np.stack([x.ravel(), y.ravel()], axis=1)
        found = appearance.likelihood(picture, places, reference, 1.0)
        return cls(places, np.where(found.visible > 0, found.lw, 0.0), side)

    @property
    def best(self) -> Floats:
        """Place (2,) px of the best match; of equal ones, which flat frames have, the nearest to the middle."""
        equal = np.flatnonzero(self.rho >= self.rho.max() - 1e-9)
        apart = np.abs(self.places[equal] - self.places.mean(axis=0)).sum(axis=1)
        best: Floats = self.places[equal[apart.argmin()]]
        return best

    def softmax(self, scale: float) -> Floats:
        """Return the probabilities (G,), proportional to exp(scale rho)."""
        weights = np.exp(scale * (self.rho - self.rho.max()))
        probabilities: Floats = weights / weights.sum()
        return probabilities
