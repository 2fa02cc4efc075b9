"""Functions of a linear Kalman filter (Kalman 1960; Bar-Shalom et al. 2001, section 5.2.4).

mean (n,), covariance P (n, n), transition F (n, n), process noise Q (n, n), measurement z (m,),
measurement matrix H (m, n), measurement noise R (m, m).
"""

from __future__ import annotations

import numpy as np

from irsim.types import Floats


def predict(mean: Floats, P: Floats, F: Floats, Q: Floats) -> tuple[Floats, Floats]:
    """Return the predicted state, F mean and F P F' + Q."""
    return F @ mean, F @ P @ F.T + Q


def innovation(mean: Floats, P: Floats, z: Floats, H: Floats, R: Floats) -> tuple[Floats, Floats]:
    """Return the innovation z - H mean and its covariance S."""
    return z - H @ mean, H @ P @ H.T + R


def update(mean: Floats, P: Floats, z: Floats, H: Floats, R: Floats) -> tuple[Floats, Floats]:
    """Return mean and covariance after a measurement z."""
    nu, S = innovation(mean, P, z, H, R)
    gain = np.linalg.solve(S, H @ P).T
    return mean + gain @ nu, updated_covariance(P, gain, H, R)


def updated_covariance(P: Floats, gain: Floats, H: Floats, R: Floats) -> Floats:
    """Return the covariance (n, n) after a measurement with a gain (n, m), by Joseph's form.

    It keeps P symmetric and positive for any gain.
    """
    rest = np.eye(len(P)) - gain @ H
    after: Floats = rest @ P @ rest.T + gain @ R @ gain.T
    return after


def squared_distance(nu: Floats, S: Floats) -> float:
    """Return the squared Mahalanobis distance nu' S^-1 nu: chi-square with len(nu) degrees of freedom."""
    return float(nu @ np.linalg.solve(S, nu))
