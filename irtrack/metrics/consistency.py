"""Whether a tracker's covariance tells how far off it is."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats


def nees(offsets: Floats, covariances: Floats) -> Floats:
    """(n,) normalised estimation error squared e' P^-1 e of errors (n, 2) px and covariances (n, 2, 2) px^2.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, eq. 5.4.2-1.
    Of an honest filter its mean is 2, the number of dimensions. nan where there is no covariance;
    inf where it has no inverse and the error is none of what it allows.
    """
    # The inverse of a 2x2 matrix written out: one without an inverse gives a plain number to test for.
    a, b, d = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    x, y = offsets[:, 0], offsets[:, 1]
    determinant = a * d - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (d * x * x - 2 * b * x * y + a * y * y) / determinant
    singular = determinant <= 0
    found[singular] = np.where((x[singular] == 0) & (y[singular] == 0), 0.0, np.inf)
    return np.asarray(found)


def nees_interval(count: int, level: float = 0.95) -> tuple[float, float]:
    """Within which the mean of `count` independent NEES of an honest filter in 2-D lies with that probability.

    Chi-square of 2 n degrees of freedom over n (the same, section 5.4.2). Errors of one track follow
    each other: count runs, not frames.
    """
    from scipy.stats import chi2

    tail = (1 - level) / 2
    return float(chi2.ppf(tail, 2 * count)) / count, float(chi2.ppf(1 - tail, 2 * count)) / count
