"""How much of noise is white, how much first-order autoregressive, and how much walks off for good.

Read off the variances of its modes (`irsim.measure.cosines`), by the likelihood of normal noise. A mode has
w^2 + s^2 ((1 - q) r(rho) + q g(rho)) + d b: white noise of sigma w, AR(1) noise of sigma s and lag-1 correlation rho, a
share q of which grows from none in the first frame, as non-uniformity does after a correction, and a random walk whose
variance grows by d a frame, as that does for as long as it is not drawn back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from irsim.measure.allowed import Allowed
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
_ALL = (True, True, True, True)
_STEADY = (True, True, False, False)
_WALKING = (True, False, False, True)
"""Which of the parts there are: any; no more than noise that was always there; no memory but a walk."""


@dataclass(frozen=True)
class _Profile:
    """At one logarithm of the decay: the likeliest variances (4,) of the parts, what twice the log likelihood lacks but
    for a constant, and which others are allowed. Parts: white, AR(1), AR(1) that grows, walk."""

    log_decay: float
    variances: Floats
    lacks: float
    allowed: Allowed


@dataclass(frozen=True)
class Mixture:
    """What was found, and all that the noise allows besides.

    best    the simplest that the interval allows: AR(1) noise without a walk, but for memory as long as can be looked
            for, which is a walk by another name; a walk without AR(1) noise; or the likeliest
    walks   whether it is that walk
    length  frames of the camera in which the noise was seen
    slices  profiles over the decays whose likelihood is within the interval's; rooms (N,) how much of it is left, in
            squared standard errors, at each
    slowest whether decays slower than any that are looked for are among them
    """

    best: _Profile
    walks: bool
    length: int
    slices: tuple[_Profile, ...]
    rooms: Floats
    slowest: bool

    def measured(self, function: Callable[[Floats, float], float]) -> Measured:
        """A function of the variances (4,) of the parts and the log decay a frame, with its interval: that of the
        profile likelihood (D. R. Cox, D. V. Hinkley, "Theoretical Statistics", 1974, section 9.3)."""
        value = function(self.best.variances, self.best.log_decay)
        ends = [value]
        for each, room in zip(self.slices, self.rooms, strict=True):
            slopes = _slopes(function, each)
            off = function(each.variances, each.log_decay) - float(slopes @ each.variances)
            ends += [off + end for end in each.allowed.ends(slopes, float(room))]
        return Measured(value, min(ends), max(ends))


def fit_mixture(blocks: Floats, freedom: float, cosines: Cosines, known: Floats | float = 0.0) -> Mixture:
    """What noise is made of.

    blocks      (N, B) mean squares of the modes in each bin, over equal blocks of pixels, independent of each other
    freedom     degrees of freedom of each mode in all of them
    known       (B,) of their variance that is something else's
    """
    from scipy.stats import t

    squares = blocks.mean(axis=0)
    weights = freedom * cosines.sizes

    def profile(log_decay: float, parts: tuple[bool, ...] = _ALL) -> _Profile:
        return _at(log_decay, squares, weights, cosines, known, parts)

    ends = _ends(cosines)
    best = _likeliest(profile, ends)
    reach = float(t.ppf((1 + LEVEL) / 2, len(blocks) - 1)) ** 2 * _excess(best, blocks, weights, cosines, known)
    slow, fast = (_side(profile, best, end, reach) for end in ends)
    slices = [best, *(profile(at) for at in np.linspace(slow, fast, _SLICES))]
    lacks = np.array([each.lacks - best.lacks for each in slices])
    steady = _likeliest(partial(profile, parts=_STEADY), ends)
    walking = profile(ends[0], _WALKING)
    walks = False
    if steady.lacks - best.lacks <= reach and steady.log_decay > ends[0] + _NEAR:
        best = steady
    elif walking.lacks - best.lacks <= reach:
        best, walks = walking, True
    return Mixture(best, walks, int(cosines.ages[-1]) + 1, tuple(slices), (reach - lacks).clip(0), slow <= ends[0])


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
    """(B, 4) what a unit of each part gives to the modes."""
    decay = math.exp(log_decay)
    return np.stack([cosines.white(), cosines.remembered(decay), cosines.grown(decay), cosines.walked()], axis=1)


def _at(
    log_decay: float,
    squares: Floats,
    weights: Floats,
    cosines: Cosines,
    known: Floats | float,
    taken: tuple[bool, ...],
) -> _Profile:
    """Likeliest variances, none below 0, by Fisher's scoring, of those parts that are `taken`."""
    from scipy.optimize import nnls

    parts = _parts(log_decay, cosines)
    size = parts.max(axis=0)
    parts = parts / size * taken
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
    parts = parts * size
    weighted = parts * (weights / foreseen**2)[:, None]
    variances = np.where(variances > least, variances, 0) / size
    return _Profile(
        log_decay, variances, lacks, Allowed(variances, weighted.T @ (foreseen - squares), weighted.T @ parts / 2)
    )


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


def _slopes(function: Callable[[Floats, float], float], at: _Profile) -> Floats:
    """(4,) of a function by the variances."""
    step = 1e-6 * (float(at.variances.sum()) or 1.0)
    here = function(at.variances, at.log_decay)
    return np.array([(function(at.variances + move, at.log_decay) - here) / step for move in step * np.eye(4)])
