"""Weighted particles: effective number, mean, covariance. Weights (N,) sum to one."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats


def neff(weights: Floats) -> float:
    """Effective number of particles, 1 / sum w^2 (Kong, Liu, Wong 1994), 1 .. N."""
    return float(1 / (weights @ weights))


def mean(weights: Floats, particles: Floats) -> Floats:
    """(d,) weighted mean of particles (N, d) (Cheng et al. 2006, eq. 3)."""
    average: Floats = weights @ particles
    return average


def covariance(weights: Floats, particles: Floats, center: Floats) -> Floats:
    """(d, d) weighted covariance of particles (N, d) about their mean."""
    off = (particles - center).T
    spread: Floats = (off * weights) @ off.T
    return spread


def normalised(logarithms: Floats) -> Floats:
    """Weights (N,) that sum to one from their logarithms, each up to the same constant."""
    weights: Floats = np.exp(logarithms - logarithms.max())
    weights /= weights.sum()
    return weights
