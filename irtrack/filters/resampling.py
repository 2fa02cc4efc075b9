"""Resampling: n indices drawn so that index i comes n w_i times in the mean.

Douc, Cappe, Moulines, "Comparison of resampling schemes for particle filtering", ISPA 2005, gives
the four schemes; multinomial by cumulative weights is the one that Cheng et al. 2006 (section 2.3,
step 2) print. Weights (N,) are not negative and sum to one; n is N unless another count is asked for.
"""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack._native import COMPILED, kernels

Indices = npt.NDArray[np.intp]
Resampling = Literal["multinomial", "systematic", "stratified", "residual"]


class Resampler(Protocol):
    def __call__(self, weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices: ...


def _pick(weights: Floats, points: Floats) -> Indices:
    """For ascending points in [0, 1): the smallest j whose cumulative weight exceeds the point.

    The last cumulative weight is left out of the search: rounding may leave it just below one.
    """
    if COMPILED:
        picked: Indices = np.empty(len(points), np.intp)
        kernels.pick(np.ascontiguousarray(weights), points, picked)
        return picked
    return _pick_plain(weights, points)


def _pick_plain(weights: Floats, points: Floats) -> Indices:
    cumulative = weights.cumsum()
    picked: Indices = cumulative[:-1].searchsorted(points * cumulative[-1], side="right")
    return picked


def _sorted_uniforms(n: int, rng: np.random.Generator) -> Floats:
    exponentials = rng.standard_exponential(n + 1)
    if COMPILED:
        kernels.sorted_uniforms(exponentials)
        return exponentials[:-1]
    sums = exponentials.cumsum()
    uniforms: Floats = sums[:-1] / sums[-1]
    return uniforms


def multinomial(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """Independent draws, in the order of their index.

    The order statistics of n uniform draws are the running sums of n + 1 exponential ones over
    their total (Devroye, "Non-Uniform Random Variate Generation", 1986, section V.3), so no sort.
    """
    return _pick(weights, _sorted_uniforms(count or len(weights), rng))


def systematic(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """One draw, then steps of 1/n: index i comes floor(n w_i) or ceil(n w_i) times."""
    n = count or len(weights)
    return _pick(weights, (np.arange(n) + rng.random()) / n)


def systematic_copies(weights: Floats, rng: np.random.Generator) -> Indices:
    """(R, N) how often `systematic` takes each particle, of many sets at once: weights (R, N).

    Point j, at (j + u) / N, falls on the first i with N c_i - u > j for cumulative weights c: up to i
    fall ceil(N c_i - u) points.
    """
    count, n = weights.shape
    marks = weights.cumsum(axis=1)
    marks *= n / marks[:, -1:]
    marks -= rng.random((count, 1))
    ends = np.ceil(marks, out=marks).astype(np.intp)
    ends[:, -1] = n  # whatever rounding says
    copies: Indices = np.diff(ends, axis=1, prepend=0)
    return copies


def stratified(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """One draw in each of n strata of 1/n."""
    n = count or len(weights)
    return _pick(weights, (np.arange(n) + rng.random(n)) / n)


def residual(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """floor(n w_i) copies for certain, the rest multinomial from what is left over."""
    n = count or len(weights)
    copies = np.floor(n * weights).astype(np.intp)
    certain = np.repeat(np.arange(len(weights)), copies)
    left = n * weights - copies
    missing = n - len(certain)
    if missing == 0:
        return certain
    return np.concatenate([certain, _pick(left / left.sum(), _sorted_uniforms(missing, rng))])


RESAMPLERS: dict[Resampling, Resampler] = {
    "multinomial": multinomial,
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
}
