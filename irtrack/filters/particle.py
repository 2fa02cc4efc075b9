"""Sequential Monte Carlo: the step that all particle filters share, weights, and the number of particles.

    resample -> move -> weigh -> estimate            (Doucet, de Freitas, Gordon 2001, chapter 1)

`smc_step` takes a tracker's three functions: `resample` picks ancestors by their weights, `move` draws from the
proposal, and `likelihood` gives log-likelihoods. `particle_estimate` makes an `Estimate` from its outcome.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Generic, TypeVar

import numpy as np

from irsim.types import Floats
from irtrack._native import COMPILED, kernels
from irtrack.filters.resampling import Indices
from irtrack.types import Estimate, Status


class Weights:
    """Normalised importance weights W of particles, from the logarithms of their unnormalised ones.

    By Bayes' rule W (..., N) is proportional to prior exp(scale lw), each set summing to one.

    lw          (..., N) log-likelihoods divided by the scale, up to a constant; -inf for a likelihood of 0
    prior       (..., N) prior weights, at least 0, of any sum; equal by default
    degenerate  True: every particle of the set has prior or likelihood 0, and all weights are equal

    The largest lw among particles with a prior above 0 is subtracted first, so that not all likelihoods can underflow.
    """

    __slots__ = ("W", "degenerate")

    def __init__(self, lw: Floats, prior: Floats | None = None, scale: float = 1.0) -> None:
        prior = np.ones(lw.shape) if prior is None else prior
        weights = (_posterior if COMPILED and lw.ndim == 1 else _posterior_plain)(lw, prior, scale)
        self.degenerate = weights is None
        self.W: Floats = equal_weights(lw.shape) if weights is None else weights

    @property
    def ESS(self) -> Floats:  # noqa: N802  # as in the literature
        """Effective sample size (...) of each set."""
        return ess(self.W)


def equal_weights(shape: int | tuple[int, ...]) -> Floats:
    """Return weights 1/N of a shape (..., N)."""
    return np.full(shape, 1 / (shape if isinstance(shape, int) else shape[-1]))


def _posterior(lw: Floats, prior: Floats, scale: float) -> Floats | None:
    prior, lw = np.ascontiguousarray(prior, np.float64), np.ascontiguousarray(lw, np.float64)
    weights = np.empty_like(lw)
    if not kernels.scaled_log_weights(prior, lw, scale, weights):
        return None
    np.exp(weights, out=weights)
    kernels.normalise_product(weights, prior)
    return weights


def _posterior_plain(lw: Floats, prior: Floats, scale: float) -> Floats | None:
    best = lw.max(axis=-1, keepdims=True, initial=-np.inf, where=prior > 0)
    if (best == -np.inf).any():
        return None
    weights: Floats = np.minimum(lw - best, 0)
    weights *= scale
    np.exp(weights, out=weights)
    weights *= prior
    return normalise(weights)


def normalise(weights: Floats) -> Floats:
    """Return weights (..., N) divided by their sums."""
    whole: Floats = weights / weights.sum(axis=-1, keepdims=True)
    return whole


def ess(W: Floats) -> Floats:
    """Return the effective sample size (...), 1 / sum W^2 (Kong, Liu, Wong 1994), 1 .. N, of weights (..., N)."""
    squares = W @ W if W.ndim == 1 else np.einsum("...n,...n->...", W, W)
    sizes: Floats = 1 / squares
    return sizes


def mean(W: Floats, particles: Floats) -> Floats:
    """Return the weighted mean (d,) of particles (N, d) (Cheng et al. 2006, eq. 3)."""
    average: Floats = W @ particles
    return average


def covariance(W: Floats, particles: Floats, center: Floats) -> Floats:
    """Return the weighted covariance (d, d) of particles (N, d) about their mean."""
    off = (particles - center).T
    squares: Floats = (off * W) @ off.T
    return squares


@dataclass(slots=True, eq=False)
class Likelihood:
    """Log-likelihoods of N particles: `scale` times `lw` (N,), up to a constant.

    `visible` (N,): share of each particle's window inside the frame; where it is 0 the likelihood is 0.
    """

    lw: Floats
    scale: float
    visible: Floats


L = TypeVar("L", bound=Likelihood)


@dataclass(slots=True, eq=False)
class Step(Generic[L]):
    """Outcome of an SMC step: particles (N, d), weights W (N,), their likelihood; True where any is inside the
    frame."""

    particles: Floats
    W: Floats
    likelihood: L
    in_view: bool


def smc_step(
    W: Floats,
    resample: Callable[[Floats], Indices] | None,
    move: Callable[[Indices | None], Floats],
    likelihood: Callable[[Floats], L],
) -> Step[L]:
    """Resample, move and weigh the particles of weights W (M,).

    resample    function that draws ancestors (N,) by weight; None: no resampling, particles keep their weights
    move        function that draws particles (N, d) from the proposal, given their ancestors
    likelihood  function that returns the likelihood of the particles

    Where all likelihoods are 0, all weights are equal.
    """
    particles = move(None if resample is None else resample(W))
    found = likelihood(particles)
    prior = W * (found.visible > 0) if resample is None else np.sign(found.visible)
    weights = Weights(found.lw, prior, found.scale)
    return Step(particles, weights.W, found, not weights.degenerate or bool(found.visible.any()))


def particle_estimate(
    particles: Floats,
    W: Floats,
    center: Floats,
    velocity: Floats,
    size: tuple[float, float],
    status: Status,
    score: float,
) -> Estimate:
    """Return the estimate of particles (N, d), x and y px first, with weights W (N,); centre and velocity (2,)."""
    x, y = center.tolist()
    vx, vy = velocity.tolist()
    return Estimate(
        center=(x, y),
        size=size,
        status=status,
        score=score,
        velocity=(vx, vy),
        covariance=covariance(W, particles[:, :2], center),
        neff=float(ess(W)),
        particles=particles,
        weights=W,
    )


def kld_bound(cells: Floats, epsilon: float, z: float) -> Floats:
    """Return the number of particles that keeps the Kullback-Leibler distance to the true distribution below epsilon.

        n = (k - 1) / (2 epsilon) (1 - 2 / (9 (k - 1)) + sqrt(2 / (9 (k - 1))) z)^3

    with the probability of the normal quantile z, for particles in k `cells` (...); one cell needs one particle (Fox,
    "Adapting the Sample Size in Particle Filters through KLD-Sampling", Int. J. Robotics Research 22(12), 2003,
    eq. 14).
    """
    free = np.maximum(cells - 1, 1)
    ninths = 2 / (9 * free)
    bound = free / (2 * epsilon) * (1 - ninths + np.sqrt(ninths) * z) ** 3
    return np.where(cells > 1, bound, 1.0)


def kld_count(positions: Floats, least: int, cell: float, epsilon: float, z: float) -> int:
    """Return the number of moved particles (N, 2) px to keep: the smallest n with n >= `kld_bound`(k), k the number of
    occupied cells.

    Particles must be in random order. A cell, `cell` px wide, is occupied if it holds one of the first n. At least
    `least` particles are kept, and all N where the bound is not reached.
    """
    places = np.floor((positions - positions.min(axis=0)) / cell).astype(np.int64)
    _, firsts = np.unique(places @ np.array([2**31, 1]), return_index=True)
    new = np.zeros(len(positions))
    new[firsts] = 1
    enough = np.arange(1, len(positions) + 1) >= np.maximum(kld_bound(new.cumsum(), epsilon, z), least)
    return int(enough.argmax()) + 1 if enough.any() else len(positions)


def ess_count(count: int, size: float, wanted: float, least: int, most: int) -> int:
    """Return the number of particles that would have the effective sample size `wanted`, clipped to least .. most."""
    return min(max(ceil(count * wanted / size), least), most)
