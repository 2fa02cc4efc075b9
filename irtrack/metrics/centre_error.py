"""Centre error, normalised error and precision curves.

An error within the accuracy of the ground truth (limited for imported boxes) passes every threshold.
"""

from __future__ import annotations

import math

import numpy as np

from irsim.types import Floats

PRECISION_PX = np.arange(0.0, 51.0)
"""Thresholds of the precision curve, px (OTB toolkit: 0:50)."""

PRECISION_NORM = np.arange(0, 51) / 100
"""Thresholds of the normalised precision curve (TrackingNet: 0 to 0.5)."""


def centre_errors(centers: Floats, truth: Floats) -> Floats:
    """Return the Euclidean distance of centres (n, 2) from true centres, (n,) px; nan where there is no true centre."""
    offsets = np.asarray(centers, dtype=np.float64) - truth
    return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))


def normalised_errors(centers: Floats, truth: Floats, sizes: Floats) -> Floats:
    """Return the centre errors with each axis divided by the side of the true box, (n,).

    ||diag(w, h)^-1 (c - c_true)||, the P_norm of Mueller et al., TrackingNet, ECCV 2018, section 5.1.
    """
    offsets = (np.asarray(centers, dtype=np.float64) - truth) / sizes
    return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))


def mean_abs(offsets: Floats) -> tuple[float, float]:
    """Return mean and (population) standard deviation of |e|, for errors e on one axis; nan without errors."""
    if len(offsets) == 0:
        return np.nan, np.nan
    size = np.abs(offsets)
    mean = float(size.sum() / len(size))
    return mean, rmse(size - mean)


def rmse(errors: Floats) -> float:
    """Return the root mean square of errors; nan without errors."""
    return math.sqrt(np.square(errors).sum() / len(errors)) if len(errors) else np.nan


def precision_curve(
    errors: Floats, thresholds: Floats = PRECISION_PX, within_accuracy: np.ndarray | None = None
) -> Floats:
    """Return the share of the errors (n,) that are <= each threshold; nan without errors.

    Wu, Lim, Yang, Online Object Tracking: A Benchmark, CVPR 2013, section 3.2, after Babenko et al. 2011. The published
    figure is the value at 20 px. `within_accuracy` (n,) bool: True where the error is within the accuracy of the truth,
    and passes every threshold.
    """
    if len(errors) == 0:
        return np.full(len(thresholds), np.nan)
    errors = np.asarray(errors) if within_accuracy is None else np.where(within_accuracy, 0.0, errors)
    return np.asarray((errors[:, None] <= thresholds).sum(axis=0) / len(errors))


def area(curve: Floats) -> float:
    """Return the area under a curve of evenly spaced thresholds: its mean, as in the benchmarks."""
    return float(curve.sum() / len(curve))
