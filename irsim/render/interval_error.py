"""Error of the best match within a search gate, predicted by the method of interval errors.

At low d the highest peak of the matched filter is sometimes noise, far from the target, and the Cramér-Rao bound is far
too low. H. Van Trees, "Detection, Estimation, and Modulation Theory I", 1968, section 4.2; F. Athley, IEEE Trans.
Signal Processing 53 (2005):

    E[e²] = (1 - P) bound² + P gate²/12

P is the probability that the highest peak of the noise in the gate exceeds that of the target. The number of peaks of a
Gaussian field above t is its expected Euler characteristic (R. Adler, "The Geometry of Random Fields", 1981).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from irsim.render.moments import Exact

GATE_PX = 21.0
"""Side of the search gate, px, unless another is given."""
LEAST_D = 10.0
"""Least deflection d at which the Cramér-Rao bound holds; below, the interval error is predicted."""
LEVELS = np.linspace(-4.0, 24.0, 561)
"""Heights of peaks over which probabilities are integrated, sigma."""


def predicted_errors(covariance: Exact, d: float, gate_px: float = GATE_PX) -> tuple[float, float]:
    """Return the predicted root mean square errors (x, y), px, of the highest peak in a square gate about the target.

    covariance   (2, 2) Cramér-Rao bound of the position, px²
    """
    share = outlier_probability(np.asarray(np.linalg.inv(covariance) / d**2, np.float64), d, gate_px)
    square = gate_px**2 / 12
    x, y = (math.sqrt((1 - share) * min(each, square) + share * square) for each in np.diag(covariance))
    return x, y


def outlier_probability(curvature: Exact, d: float, gate_px: float) -> float:
    """Return the probability that the highest peak in the gate is noise.

    curvature   (2, 2) of the correlation of the matched filter's noise, 1/px²; it is that of the target's peak too

    The target's peak is d + 1/d high in the mean: the two coordinates of its place follow the noise.
    """
    peak = np.exp(-((LEVELS - d - 1 / d) ** 2) / 2)
    return float((peak * _noise_exceeds(curvature, gate_px)).sum() / peak.sum())


def _noise_exceeds(curvature: Exact, gate_px: float) -> Exact:
    """Return the probability that the noise in the gate exceeds each of LEVELS."""
    edges = gate_px * (math.sqrt(curvature[0, 0]) + math.sqrt(curvature[1, 1])) / (2 * math.pi)
    area = gate_px**2 * math.sqrt(max(float(np.linalg.det(curvature)), 0.0)) / (2 * math.pi) ** 1.5
    fall = np.exp(-(LEVELS**2) / 2)
    expected = ndtr(-LEVELS) + (edges + area * LEVELS) * fall
    # Below its largest value the expectation no longer counts peaks: there the noise exceeds the level.
    expected = np.maximum.accumulate(expected[::-1])[::-1]
    return np.asarray(-np.expm1(-expected))
