"""Ensemble of weak linear classifiers of pixels, weighted by AdaBoost, and the features of a pixel.

S. Avidan, "Ensemble Tracking", IEEE TPAMI 29(2), 2007, sections 3.1 to 3.3 and Algorithm 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.types import Floats, Image
from irtrack.features.gradients import orientations, sobel

DIRECTIONS = 8
"""Bins of the orientation histogram (section 3.3: 8)."""
SIDE = 5
"""Side of the orientation histogram's window, px (section 3.3: 5)."""
_LEAST = 1e-3
"""Least weighted error, so that votes stay finite."""
_RIDGE = 1e-9


def pixel_features(image: Image, region: tuple[int, int, int, int], low: float, high: float) -> Floats:
    """Return features (rows, cols, 9) of a region (left, top, right, bottom) of a frame: the orientation histogram over
    5 x 5 px, weighted by magnitude, and the grey level; both in units of the grey range low .. high, counts."""
    left, top, right, bottom = region
    cells, magnitude = orientations(*sobel(image, left, top, right, bottom), DIRECTIONS)
    scale = 1 / max(high - low, 1e-9)
    maps = [
        cv2.boxFilter(np.where(cells == u, magnitude, 0).astype(np.float64), -1, (SIDE, SIDE), normalize=True)
        for u in range(DIRECTIONS)
    ]
    grey = (image[top:bottom, left:right].astype(np.float64) - low) * scale
    return np.stack([*(each * scale for each in maps), grey], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """Classifiers sign(planes [x, 1]) (T, d + 1) with votes (T,); the score is their weighted mean, -1 .. 1."""

    planes: Floats
    votes: Floats

    @classmethod
    def fitted(cls, features: Floats, labels: Floats, count: int) -> Ensemble:
        """Return `count` classifiers trained one by one on features (n, d), labels (n,) of -1 and 1."""
        return cls(np.zeros((0, features.shape[1] + 1)), np.zeros(0)).updated(features, labels, count, keep=0)

    def updated(self, features: Floats, labels: Floats, count: int, keep: int) -> Ensemble:
        """Return the ensemble after a frame: the `keep` best classifiers, weighted anew, then new ones up to `count`.

        Best: least weighted error, chosen one by one as weights change (Algorithm 2, steps 3 and 4).
        """
        x = with_constant(features)
        weights = balanced(labels)
        left = list(self.planes)
        planes: list[Floats] = []
        votes: list[float] = []
        for turn in range(count):
            if turn < keep and left:
                misses = [(np.sign(x @ plane) != labels) @ weights for plane in left]
                plane = left.pop(int(np.argmin(misses)))
            else:
                plane = weak_fit(x, labels, weights)
            wrong = np.sign(x @ plane) != labels
            error = min(max(float(wrong @ weights), _LEAST), 1 - _LEAST)
            vote = 0.5 * np.log((1 - error) / error)
            weights = weights * np.exp(vote * np.where(wrong, 1.0, -1.0))
            weights /= weights.sum()
            planes.append(plane)
            votes.append(max(float(vote), 0.0))
        return Ensemble(np.array(planes), np.array(votes))

    def scores(self, features: Floats) -> Floats:
        """Return scores (...), -1 .. 1, of features (..., d); 0 where no classifier has a vote."""
        total = self.votes.sum()
        signs: Floats = np.sign(with_constant(features) @ self.planes.T)
        found: Floats = signs @ self.votes / (total if total > 0 else 1.0)
        return found


def balanced(labels: Floats) -> Floats:
    """Return weights (n,) that sum to 1/2 over each of both classes."""
    positive = labels > 0
    weights: Floats = np.where(positive, 0.5 / max(positive.sum(), 1), 0.5 / max((~positive).sum(), 1))
    whole: Floats = weights / weights.sum()
    return whole


def weak_fit(x: Floats, labels: Floats, weights: Floats) -> Floats:
    """Return the plane (d + 1,) with the least weighted squared error of x (n, d + 1) against labels (eq. 2)."""
    weighted = x * weights[:, None]
    square = weighted.T @ x
    plane: Floats = np.linalg.solve(square + _RIDGE * np.eye(len(square)), weighted.T @ labels)
    return plane


def with_constant(features: Floats) -> Floats:
    """Return features (..., d + 1) with a last feature 1."""
    return np.concatenate([features, np.ones((*features.shape[:-1], 1))], axis=-1)
