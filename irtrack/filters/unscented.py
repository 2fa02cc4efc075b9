"""Scaled sigma points of the unscented transform, in sets of any number.

R. van der Merwe, "Sigma-Point Kalman Filters for Probabilistic Inference in Dynamic State-Space Models", 2004, eq. 3.13
to 3.15; S. Julier, J. Uhlmann, "Unscented filtering and nonlinear estimation", Proc. IEEE 92(3), 2004.
"""

from __future__ import annotations

import numpy as np

from irsim.types import Floats

ALPHA, BETA, KAPPA = 0.5, 2.0, 0.0
"""Scale of the points about the mean; weight of the central point in covariances (2: best for a normal); second
scale."""


def square_root(P: Floats) -> Floats:
    """Return L with L L' = P of covariances (..., d, d): Cholesky factors, or symmetric roots where any is singular."""
    try:
        return np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(P)
        root: Floats = vectors * np.sqrt(np.maximum(values, 0))[..., None, :]
        return root


def sigma_points(mean: Floats, P: Floats, alpha: float = ALPHA, kappa: float = KAPPA) -> Floats:
    """Return the points (..., 2 d + 1, d) of means (..., d), covariances (..., d, d): the mean, then plus, then
    minus."""
    d = mean.shape[-1]
    scale = alpha**2 * (d + kappa)
    columns = np.swapaxes(square_root(scale * P), -1, -2)
    center = mean[..., None, :]
    return np.concatenate([center, center + columns, center - columns], axis=-2)


def sigma_weights(d: int, alpha: float = ALPHA, beta: float = BETA, kappa: float = KAPPA) -> tuple[Floats, Floats]:
    """Return the weights (2 d + 1,) of the points in means and in covariances."""
    scale = alpha**2 * (d + kappa)
    of_mean: Floats = np.full(2 * d + 1, 0.5 / scale)
    of_mean[0] = 1 - d / scale
    of_covariance = of_mean.copy()
    of_covariance[0] += 1 - alpha**2 + beta
    return of_mean, of_covariance
