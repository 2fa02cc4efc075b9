"""Resampling: n indices drawn so that index i comes n w_i times on average; and weight selection.

The four schemes are those of Douc, Cappe, Moulines, "Comparison of resampling schemes for particle filtering", ISPA
2005; Cheng et al. 2006 (section 2.3, step 2) print the multinomial one. Weights (N,) are at least 0 and sum to one; n
is N by default. Weight selection (Li, Li 2014, section 2) moves the largest weights to the front, in one set or many,
(..., N).
"""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack._native import COMPILED, kernels

Indices = npt.NDArray[np.intp]
Resampling = Literal["multinomial", "systematic", "stratified", "residual"]
Restoring = Literal["own", "equal"]


class Resampler(Protocol):
    def __call__(self, weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices: ...


def _pick(weights: Floats, points: Floats) -> Indices:
    """Return, for each of the ascending points in [0, 1), the smallest j whose cumulative weight exceeds it.

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
    """Draw indices independently, in ascending order.

    The order statistics of n uniform draws are the running sums of n + 1 exponential ones over their total (Devroye,
    "Non-Uniform Random Variate Generation", 1986, section V.3); no sort is needed.
    """
    return _pick(weights, _sorted_uniforms(count or len(weights), rng))


def systematic(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """Draw one point, then step by 1/n: index i comes floor(n w_i) or ceil(n w_i) times."""
    n = count or len(weights)
    return _pick(weights, (np.arange(n) + rng.random()) / n)


def systematic_copies(weights: Floats, rng: np.random.Generator) -> Indices:
    """Return the number of times (R, N) that `systematic` takes each particle, for R sets of weights (R, N)."""
    return copies_at(weights, rng.random((len(weights), 1)))


def copies_at(weights: Floats, u: Floats) -> Indices:
    """Return the number of times (R, N) that `systematic` takes each particle of weights (R, N), for uniform u (R, 1).

    Point j, at (j + u) / N for one u of [0, 1), falls on the first i with N c_i - u > j for cumulative weights c:
    ceil(N c_i - u) points fall on particles up to i.
    """
    n = weights.shape[1]
    marks = weights.cumsum(axis=1)
    marks *= n / marks[:, -1:]
    marks -= u
    ends = np.ceil(marks, out=marks).astype(np.intp)
    ends[:, -1] = n  # exact despite rounding
    copies: Indices = np.diff(ends, axis=1, prepend=0)
    return copies


def stratified(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """Draw one point in each of n strata of 1/n."""
    n = count or len(weights)
    return _pick(weights, (np.arange(n) + rng.random(n)) / n)


def residual(weights: Floats, rng: np.random.Generator, count: int | None = None) -> Indices:
    """Take floor(n w_i) copies, and draw the rest multinomially from the remainders."""
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


def largest_first(weights: Floats, count: int) -> Indices:
    """Return indices (..., N) with those of the `count` largest weights in front, in no particular order (Li, Li 2014,
    Step 3)."""
    n = weights.shape[-1]
    if count >= n:
        return np.broadcast_to(np.arange(n), weights.shape)
    front_last: Indices = weights.argpartition(n - count, axis=-1)[..., ::-1]
    return front_last


def after_selection(weights: Floats, count: int, restoring: Restoring) -> Floats:
    """Return weights (..., N) after the `count` in front were resampled among themselves (Li, Li 2014, Step 6).

    The printed formula is illegible. `own`: the particles in front share their total weight and the others keep theirs,
    which keeps the distribution. `equal`: all get 1/N, so that the others have too large a share: 44 % at Np = .56 N.
    """
    if restoring == "equal":
        return np.full(weights.shape, 1 / weights.shape[-1])
    after = weights.copy()
    after[..., :count] = weights[..., :count].mean(axis=-1, keepdims=True)
    return after
