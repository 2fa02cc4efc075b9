"""How much of noise is white, how much first-order autoregressive, how much walks off for good, and what stays.

Read off the variances of its modes (`irsim.measure.cosines`), by the likelihood of normal noise. A mode has
w^2 + s^2 ((1 - q) r(rho) + q g(rho)) + d b: white noise of sigma w, AR(1) noise of sigma s and lag-1 correlation rho, a
share q of which grows from none in the first frame, as non-uniformity does after a correction, and a random walk whose
variance grows by d a frame, as that does for as long as it is not drawn back. The constant mode has fixed pattern
besides, of any variance: it says of the others that they leave no more in the mean than there is.
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
_FASTEST = 3.0
"""Decay a frame up to which is looked: correlation is 0.05 then. Noise that forgets faster is called white: frames do
not tell how much of both there is, and pictures hardly differ."""
_GRID = 41
_NEAR = 2e-5
"""To what the logarithm of the likeliest decay is found: a thousandth of a close interval, that of 300 frames of 48 x
48 px; ten times as much changes ends of `rho` by 4e-7."""
_ROUNDS = 30
_SETTLED = 1e-9
"""Relative change of the likelihood's logarithm at which the variances are found."""
_LEAST = 1e-12
"""Share of the variance that white noise has at least, that no mode be without any."""
_HALVINGS = 12
_SLICES = 11
_ALL = (True, True, True, True, True)
_STEADY = (True, True, False, False, True)
_WALKING = (True, False, False, True, True)
_GROWING = (True, False, True, False, True)
"""Which of the parts there are: any; noise that was always there; a walk; noise that grows since the first frame."""


@dataclass(frozen=True)
class _Profile:
    """At one logarithm of the decay: the likeliest variances (5,) of the parts, what twice the log likelihood lacks but
    for a constant, and which others are allowed. Parts: white, AR(1), AR(1) that grows, walk a frame, fixed."""

    log_decay: float
    variances: Floats
    lacks: float
    allowed: Allowed


@dataclass(frozen=True)
class Mixture:
    """What was found, and all that the noise allows besides.

    best    of AR(1) noise, a walk, AR(1) noise that grows, and all at once, as far as the interval allows it, the
            likeliest, each further parameter weighing as much as a factor e (QAIC: K. P. Burnham, D. R. Anderson,
            "Model Selection and Multimodel Inference", 2002, section 2.5)
    walks   whether it is the walk
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
        """A function of the variances (5,) of the parts and the log decay a frame, with its interval: that of the
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
    excess = _excess(best, blocks, weights, cosines, known)
    reach = float(t.ppf((1 + LEVEL) / 2, len(blocks) - 1)) ** 2 * excess
    slow, fast = (_side(profile, best, end, reach) for end in ends)
    walking = profile(ends[0], _WALKING)
    steady, growing = (_likeliest(partial(profile, parts=parts), ends) for parts in (_STEADY, _GROWING))
    # That noise grows, and is not always there, counts as a parameter: where it forgets soon both look alike.
    models = ((steady, 3), (walking, 2), (growing, 4), (best, 5))
    told = (model for model in models if model[0].lacks - best.lacks <= reach)
    taken = min(told, key=lambda model: model[0].lacks / excess + 2 * model[1])[0]
    slices = [best, taken, *(profile(at) for at in np.linspace(slow, fast, _SLICES))]
    rooms = np.array([reach - (each.lacks - best.lacks) for each in slices]).clip(0)
    return Mixture(taken, taken is walking, int(cosines.ages[-1]) + 1, tuple(slices), rooms, slow <= ends[0])


def _likeliest(profile: Callable[[float], _Profile], ends: tuple[float, float]) -> _Profile:
    """The best of a grid over the decays, or about it; an end where that is the best."""
    from scipy.optimize import minimize_scalar

    grid = np.linspace(*ends, _GRID)
    found = [profile(at) for at in grid]
    place = int(np.argmin([each.lacks for each in found]))
    about = (grid[max(place - 1, 0)], grid[min(place + 1, _GRID - 1)])
    near = minimize_scalar(lambda at: profile(at).lacks, bounds=about, options={"xatol": _NEAR})
    return min(found[place], profile(float(near.x)), key=lambda each: each.lacks)


def _ends(cosines: Cosines) -> tuple[float, float]:
    return -math.log(SLOWEST * cosines.basis.shape[1]), math.log(_FASTEST)


def parts_at(log_decay: float, cosines: Cosines) -> Floats:
    """(B, 5) what a unit of each part of `Mixture.measured` gives to the modes, at a log decay a frame."""
    decay = math.exp(log_decay)
    lasting = (cosines.remembered(decay), cosines.grown(decay), cosines.walked())
    return np.stack([cosines.white(), *lasting, cosines.fixed()], axis=1)


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

    parts = parts_at(log_decay, cosines)
    size = parts.max(axis=0)
    parts = parts / size * taken
    least = _LEAST * float(squares[1:].mean())
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
    and mode to mode; at least 1 (P. McCullagh, J. A. Nelder, "Generalized Linear Models", 1989, section 9.2.3). The
    constant mode does not count: fixed pattern may be anything, of a scene, too."""
    step = 1e-3
    parts = parts_at(best.log_decay, cosines)
    foreseen = known + parts @ best.variances
    slope = (parts_at(best.log_decay + step, cosines) - parts) @ best.variances / step
    parts = np.column_stack([parts[:, :-1], slope])[1:]
    parts = parts / np.abs(parts).max(axis=0).clip(1e-300)
    weighted = parts * (weights / foreseen**2)[1:, None] / 2
    blocks = blocks[:, 1:]
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
    """(5,) of a function by the variances."""
    step = 1e-6 * (float(at.variances.sum()) or 1.0)
    here = function(at.variances, at.log_decay)
    return np.array([(function(at.variances + move, at.log_decay) - here) / step for move in step * np.eye(5)])
