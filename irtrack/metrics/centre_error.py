"""Figures of the centre error.

Truth of a limited accuracy (imported boxes) scores nothing tighter than it: a centre within the
accuracy of its frame is right at any threshold.
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
    """(n,) px: Euclidean distance of (n, 2) centres from (n, 2) true ones; nan where there is none."""
    offsets = np.asarray(centers, dtype=np.float64) - truth
    return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))


def normalised_errors(centers: Floats, truth: Floats, sizes: Floats) -> Floats:
    """(n,): centre errors with each axis divided by the true box's side.

    ||diag(w, h)^-1 (c - c_true)||, the P_norm of Mueller et al., TrackingNet, ECCV 2018, section 5.1.
    """
    offsets = (np.asarray(centers, dtype=np.float64) - truth) / sizes
    return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))


def mean_abs(offsets: Floats) -> tuple[float, float]:
    """Mean of |e| and its (population) standard deviation, of one axis' errors; nan of nothing."""
    if len(offsets) == 0:
        return np.nan, np.nan
    size = np.abs(offsets)
    mean = float(size.sum() / len(size))
    return mean, rmse(size - mean)


def rmse(errors: Floats) -> float:
    """Root mean square; nan of nothing."""
    return math.sqrt(np.square(errors).sum() / len(errors)) if len(errors) else np.nan


def precision_curve(
    errors: Floats, thresholds: Floats = PRECISION_PX, within_accuracy: np.ndarray | None = None
) -> Floats:
    """(len(thresholds),): share of the errors (n,) that are <= each threshold; nan of nothing.

    Wu, Lim, Yang, Online Object Tracking: A Benchmark, CVPR 2013, section 3.2 (there also Babenko
    2011). The published figure is the one at 20 px. `within_accuracy` (n,) bool: errors that the
    truth cannot tell from none, right at any threshold.
    """
    if len(errors) == 0:
        return np.full(len(thresholds), np.nan)
    errors = np.asarray(errors) if within_accuracy is None else np.where(within_accuracy, 0.0, errors)
    return np.asarray((errors[:, None] <= thresholds).sum(axis=0) / len(errors))


def area(curve: Floats) -> float:
    """Area under a curve of evenly spaced thresholds, as the benchmarks take it: its mean."""
    return float(curve.sum() / len(curve))
