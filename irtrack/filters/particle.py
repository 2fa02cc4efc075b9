"""Weighted particles: their weights by Bayes' rule, effective number, mean, covariance."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats
from irtrack._native import COMPILED, kernels


def reweigh(prior: Floats, score: Floats, sharpness: float = 1.0) -> Floats | None:
    """Weights proportional to prior exp(sharpness * score), each set summing to one: Bayes' rule, where the score is
    the logarithm of the likelihood up to a factor, the sharpness, and any constant.

    prior, score   (N,) of one set of particles, or (..., N) of many; prior at least 0, of any sum; score finite, or
                   -inf for a likelihood of 0, where the sharpness is above 0
    sharpness      0: all particles are alike, but for their priors

    None where nothing is left in a set: every particle in it has a prior or a likelihood of 0. The best score among
    the particles of a prior above 0 is taken as 0, so that those cannot all underflow, whatever the others score.
    """
    if COMPILED and prior.ndim == 1:
        prior, score = np.ascontiguousarray(prior, np.float64), np.ascontiguousarray(score, np.float64)
        weights = np.empty_like(score)
        if not kernels.below_best(prior, score, sharpness, weights):
            return None
        np.exp(weights, out=weights)
        kernels.weighted(weights, prior)
        return weights
    return _reweigh_plain(prior, score, sharpness)


def _reweigh_plain(prior: Floats, score: Floats, sharpness: float) -> Floats | None:
    best = score.max(axis=-1, keepdims=True, initial=-np.inf, where=prior > 0)
    if (best == -np.inf).any():
        return None
    weights: Floats = np.minimum(score - best, 0)
    weights *= sharpness
    np.exp(weights, out=weights)
    weights *= prior
    weights /= weights.sum(axis=-1, keepdims=True)
    return weights


def shares(weights: Floats) -> Floats | None:
    """Weights (N,), at least 0, over their sum; None where all are 0."""
    total = weights.sum()
    return weights / total if total > 0 else None


def neff(weights: Floats) -> Floats:
    """(...,) effective number of particles, 1 / sum w^2 (Kong, Liu, Wong 1994), 1 .. N, of sets of weights (..., N)."""
    squares = weights @ weights if weights.ndim == 1 else np.einsum("...n,...n->...", weights, weights)
    numbers: Floats = 1 / squares
    return numbers


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
