"""How much of noise is white, how much first-order autoregressive, and how much walks off for good.

Read off the variances of its modes (`irsim.measure.cosines`), by the likelihood of normal noise. A mode has
w^2 + s^2 r(rho) + d b: white noise of sigma w, AR(1) noise of sigma s and lag-1 correlation rho, and a random walk
whose variance grows by d a frame, as non-uniformity between corrections does for as long as it is not drawn back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from irsim.measure.cosines import Cosines
from irsim.measure.interval import LEVEL, Measured
from irsim.types import Floats

SLOWEST = 10.0
"""Time constants are looked for up to so many times the frames' number: whatever is longer looks alike in them."""
_FASTEST = 6.0
"""Decay a frame up to which is looked: correlation is 0.002 then."""
_GRID = 41
_ROUNDS = 30
_SETTLED = 1e-9
"""Relative change of the likelihood's logarithm at which the variances are found."""
_LEAST = 1e-12
"""Share of the variance that white noise has at least, that no mode be without any."""
_NEAR = 1e-6
"""The end of a search is met within this."""
_HALVINGS = 12
_SLICES = 11


@dataclass(frozen=True)
class _Profile:
    """At one logarithm of the decay: the likeliest variances (3,) of the parts, what twice the log likelihood lacks but
    for a constant, and the variances' covariance (3, 3)."""

    log_decay: float
    variances: Floats
    lacks: float
    covariance: Floats


@dataclass(frozen=True)
class Mixture:
    """What was found, and all that the noise allows besides.

    best    the likeliest; without a walk where that is within the interval, too, but for memory as long as can be
            looked for, which is a walk by another name
    slices  profiles over the decays whose likelihood is within the interval's; rooms (N,) how much of it is left, in
            squared standard errors, at each
    slowest whether decays slower than any that are looked for are among them
    """

    best: _Profile
    slices: tuple[_Profile, ...]
    rooms: Floats
    slowest: bool

    def measured(self, function: Callable[[Floats, float], float]) -> Measured:
        """A function of the variances (white, AR(1), walk a frame) and the log decay a frame, with its interval: that
        of the profile likelihood (D. R. Cox, D. V. Hinkley, "Theoretical Statistics", 1974, section 9.3)."""
        value = function(self.best.variances, self.best.log_decay)
        low = high = value
        for each, room in zip(self.slices, self.rooms, strict=True):
            here = function(each.variances, each.log_decay)
            reach = math.sqrt(max(room * _variance(function, each), 0.0))
            low, high = min(low, here - reach), max(high, here + reach)
        return Measured(value, low, high)


def fit_mixture(blocks: Floats, freedom: float, cosines: Cosines, known: Floats | float = 0.0) -> Mixture:
    """What noise is made of.

    blocks      (N, B) mean squares of the modes in each bin, over equal blocks of pixels, independent of each other
    freedom     degrees of freedom of each mode in all of them
    known       (B,) of their variance that is something else's
    """
    from scipy.stats import t

    squares = blocks.mean(axis=0)
    weights = freedom * cosines.sizes

    def profile(log_decay: float, walks: bool = True) -> _Profile:
        return _at(log_decay, squares, weights, cosines, known, walks)

    ends = _ends(cosines)
    best = _likeliest(profile, ends)
    reach = float(t.ppf((1 + LEVEL) / 2, len(blocks) - 1)) ** 2 * _excess(best, blocks, weights, cosines, known)
    slow, fast = (_side(profile, best, end, reach) for end in ends)
    slices = [best, *(profile(at) for at in np.linspace(slow, fast, _SLICES))]
    lacks = np.array([each.lacks - best.lacks for each in slices])
    simple = _likeliest(partial(profile, walks=False), ends)
    taken = simple if simple.lacks - best.lacks <= reach and simple.log_decay > ends[0] + _NEAR else best
    return Mixture(taken, tuple(slices), (reach - lacks).clip(0), slow <= ends[0])


def _likeliest(profile: Callable[[float], _Profile], ends: tuple[float, float]) -> _Profile:
    low, high = ends
    for _ in range(4):
        found = [profile(at) for at in np.linspace(low, high, _GRID)]
        place = int(np.argmin([each.lacks for each in found]))
        low, high = found[max(place - 1, 0)].log_decay, found[min(place + 1, _GRID - 1)].log_decay
    return found[place]


def _ends(cosines: Cosines) -> tuple[float, float]:
    return -math.log(SLOWEST * cosines.basis.shape[1]), math.log(_FASTEST)


def _parts(log_decay: float, cosines: Cosines) -> Floats:
    """(B, 3) what a unit of each part gives to the modes."""
    return np.stack([cosines.white(), cosines.remembered(math.exp(log_decay)), cosines.walked()], axis=1)


def _at(
    log_decay: float, squares: Floats, weights: Floats, cosines: Cosines, known: Floats | float, walks: bool
) -> _Profile:
    """Likeliest variances, none below 0, by Fisher's scoring; where nothing `walks`, of the first two alone."""
    from scipy.optimize import nnls

    parts = _parts(log_decay, cosines)
    size = parts.max(axis=0)
    parts = parts / size
    if not walks:
        parts[:, 2] = 0
    least = _LEAST * float(squares.mean())
    foreseen, lacks = squares.clip(least), math.inf
    for _ in range(_ROUNDS):
        scale = np.sqrt(weights) / foreseen
        variances, _ = nnls(parts * scale[:, None], (squares - known) * scale)
        variances[0] = max(variances[0], least)
        foreseen = known + parts @ variances
        before, lacks = lacks, float(weights @ (np.log(foreseen) + squares / foreseen))
        if abs(before - lacks) <= _SETTLED * abs(lacks):
            break
    information = (parts * (weights / foreseen**2)[:, None]).T @ parts / 2
    covariance = np.linalg.pinv(information, hermitian=True)
    return _Profile(log_decay, variances / size, lacks, covariance / np.outer(size, size))


def _excess(best: _Profile, blocks: Floats, weights: Floats, cosines: Cosines, known: Floats | float) -> float:
    """By how much scores of the blocks scatter more than those of normal noise that is independent from pixel to pixel
    and mode to mode; at least 1 (P. McCullagh, J. A. Nelder, "Generalized Linear Models", 1989, section 9.2.3)."""
    step = 1e-3
    parts = _parts(best.log_decay, cosines)
    slope = (_parts(best.log_decay + step, cosines) - parts) @ best.variances / step
    parts = np.column_stack([parts, slope])
    parts = parts / np.abs(parts).max(axis=0).clip(1e-300)
    foreseen = known + _parts(best.log_decay, cosines) @ best.variances
    weighted = parts * (weights / foreseen**2)[:, None] / 2
    count = len(blocks)
    scores = (blocks - blocks.mean(axis=0)) / count @ weighted
    scatter = scores.T @ scores * count / (count - 1)
    inverse = np.linalg.pinv(weighted.T @ parts, hermitian=True)
    return max(1.0, float(np.trace(inverse @ scatter) / parts.shape[1]))


def _side(profile: Callable[[float], _Profile], best: _Profile, end: float, reach: float) -> float:
    """The log decay towards `end` at which the likelihood lacks `reach`, or the end."""
    inner, step = best.log_decay, math.copysign(0.02, end - best.log_decay)
    while True:
        outer = best.log_decay + step
        if abs(step) >= abs(end - best.log_decay):
            outer = end
        if profile(outer).lacks - best.lacks > reach:
            break
        if outer == end:
            return end
        inner, step = outer, 2 * step
    for _ in range(_HALVINGS):
        middle = (inner + outer) / 2
        inside = profile(middle).lacks - best.lacks <= reach
        inner, outer = (middle, outer) if inside else (inner, middle)
    return inner


def _variance(function: Callable[[Floats, float], float], at: _Profile) -> float:
    """Of a function's value by the variances' covariance, by its slopes."""
    slopes = np.empty(3)
    for i, step in enumerate(np.sqrt(np.diag(at.covariance)) * 1e-3 + 1e-300):
        moved = at.variances.copy()
        moved[i] += step
        slopes[i] = (function(moved, at.log_decay) - function(at.variances, at.log_decay)) / step
    return float(np.einsum("i,ij,j", slopes, at.covariance, slopes))
