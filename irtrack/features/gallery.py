"""Appearance of a target of any size, and its gallery: running mean and covariance over frames."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log

import numpy as np

from irsim.types import Floats, Image

REACH = 7
"""Half side of the square in which an appearance is measured, px; its edge is the local background."""
PRIOR_SD = np.array([0.15, 0.25, 0.2, 0.2])
"""Standard deviations of an appearance from frame to frame where a gallery knows none."""
PRIOR = 10.0
"""Weight of the prior in a covariance, frames."""
LEAST = 1.0
"""Least contrast whose logarithm is taken, counts."""


def appearance_vector(image: Image, center: tuple[float, float]) -> Floats | None:
    """Return logarithms of contrast, flux, and deviations along x and y, (4,); None at the frame's edge.

    Contrast is the largest mean of 3 x 3 px less the median of the square's edge; flux the sum of all excess over that
    median; a cold target is measured in the negative.
    """
    x, y = (floor(c + 0.5) for c in center)
    rows, columns = image.shape
    if not (REACH <= x < columns - REACH and REACH <= y < rows - REACH):
        return None
    part = image[y - REACH : y + REACH + 1, x - REACH : x + REACH + 1].astype(np.float64)
    edge = np.concatenate([part[0], part[-1], part[1:-1, 0], part[1:-1, -1]])
    excess = part - np.median(edge)
    middle = excess[REACH - 1 : REACH + 2, REACH - 1 : REACH + 2].mean()
    excess = excess if middle >= 0 else -excess
    noise = 1.4826 * float(np.median(np.abs(edge - np.median(edge))))
    weights = np.where(excess > max(2 * noise, 0.2 * abs(middle)), excess, 0.0)
    total = max(float(weights.sum()), LEAST)
    offsets = np.arange(-REACH, REACH + 1)
    across, down = weights.sum(axis=0), weights.sum(axis=1)
    variances = [float(m @ offsets**2) / total - (float(m @ offsets) / total) ** 2 for m in (across, down)]
    spreads = [0.5 * log(max(v, 0.1)) for v in variances]
    return np.array([log(max(abs(middle), LEAST)), log(total), *spreads])


@dataclass(frozen=True, slots=True, eq=False)
class Gallery:
    """Running mean (4,) and sum of squares (4, 4) about it, of `count` appearances (Welford 1962)."""

    count: int
    mean: Floats
    squares: Floats

    @classmethod
    def empty(cls) -> Gallery:
        """Return a gallery without appearances."""
        return cls(0, np.zeros(len(PRIOR_SD)), np.zeros((len(PRIOR_SD), len(PRIOR_SD))))

    def learned(self, vector: Floats) -> Gallery:
        """Return the gallery with a further appearance (4,)."""
        apart = vector - self.mean
        mean = self.mean + apart / (self.count + 1)
        return Gallery(self.count + 1, mean, self.squares + np.outer(apart, vector - mean))

    @property
    def covariance(self) -> Floats:
        """Covariance (4, 4) of an appearance, with the prior's weight of `PRIOR` frames."""
        return (self.squares + PRIOR * np.diag(PRIOR_SD**2)) / (self.count + PRIOR)

    def distance(self, other: Gallery) -> float:
        """Return the squared Mahalanobis distance of the means, by the covariance of an appearance and of both means.

        An appearance drifts slowly, so that means of many frames are no surer than one.
        """
        spread = self.covariance * (1 + 1 / max(other.count, 1))
        apart = other.mean - self.mean
        return float(apart @ np.linalg.solve(spread, apart))
