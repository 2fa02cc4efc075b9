"""How long what goes to and fro between two levels stays on each, seen only now and then: a random telegraph signal."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from irsim.measure.interval import ENDS, Measured
from irsim.measure.occupied import log_occupied
from irsim.types import Bools, Floats, Indices

_LEAST = 0.1
"""Mean time that is looked for at least, in the shortest time between two frames: what goes to and fro faster is new in
each frame, and does not tell by how much."""
_MOST = 10.0
"""And at most, in the time that is seen: more a few changes do not tell."""
_COARSE, _FINE = 60, 80
"""Times along each axis of the grids."""
_WITHIN = 8.0
"""Log likelihood below the most, to where the fine grid reaches: four standard errors where it is normal."""
_AT_ONCE = 4_000_000
"""Pixels times grid points that are worked out together."""
_TINY = np.finfo(np.float64).tiny
_MOST_ASKED = 32
"""Looks on either level that it may take to find a pixel whose times are read; of others, which jump by little, times
say less than it takes to count theirs. In 100 frames it is all, in 300 those that jump by 9 times the noise or more."""
_CLEAR = 2.5
"""Standard deviations of a vote by chance beyond which it is clear: of seven that all agree; 1 in 80 by chance."""


@dataclass(frozen=True)
class Telegraph:
    """Mean times on and off, and the share of such pixels that changes while it is looked at."""

    on: Measured
    off: Measured
    seen: Measured


def telegraph(
    high: Bools, passed: Floats, on_if_high: Floats | None = None, least: Floats | None = None
) -> Telegraph | None:
    """Of what is seen high or not (T, pixels); None where nothing changes.

    passed      (T - 1,) time from each to the next
    least       (pixels,) the share of the time that each had to be high, and low, to be found
    on_if_high  (pixels,) what else tells of them: 1 for on where it is high, -1 where it is low, 0 where nothing does

    All pixels have the same two, each exponential. Between two looks at p from each other one is on again, if it was,
    by w + (1 - w) e^(-p (1/on + 1/off)), w = on / (on + off) (the two-state Markov chain; D. R. Cox and H. D. Miller,
    "The Theory of Stochastic Processes", 1965, section 4.5). The likeliest times over a grid, given that all are on
    both levels for as long as it takes to be found (those for which that is long are left out, unless all are); and the
    ends to which the profile of the likelihood falls by 1.92.

    That tells which level of a pixel is the shorter one. On is the shorter, unless `on_if_high` says otherwise of most,
    beyond chance; where it tells neither, the intervals hold both.
    """
    changes = (high[1:] != high[:-1]).any(axis=0)
    if not changes.any():
        return None
    asked = np.ones(high.shape[1]) if least is None else np.ceil(least * len(high)).clip(1)
    if (changes & (asked <= _MOST_ASKED)).any():
        changes &= asked <= _MOST_ASKED
    high, asked = high[:, changes], np.where(asked <= _MOST_ASKED, asked, 1).astype(np.intp)[changes]
    times, which = np.unique(passed, return_inverse=True)
    seen = _seen(high, which, len(times))
    on: Floats = np.geomspace(_LEAST * float(times[0]), _MOST * float(passed.sum()), _COARSE)
    off = on
    likely, changing = _likelihoods(seen, times, passed, asked, on, off)
    near = likely > likely.max() - _WITHIN
    on, off = (_finer(axis, near.any(axis=other)) for axis, other in ((on, 1), (off, 0)))
    likely, changing = _likelihoods(seen, times, passed, asked, on, off)
    best, inside = np.unravel_index(int(np.argmax(likely)), likely.shape), likely > likely.max() - ENDS**2 / 2
    shares = changing[inside]
    short, long = _profile(on, likely.max(axis=1)), _profile(off, likely.max(axis=0))
    share = Measured(float(changing[best]), float(shares.min()), float(shares.max()))
    if on_if_high is None:
        return Telegraph(short, long, share)
    as_high, as_low = (seen @ law for law in _laws(times, on[best[0], None], off[best[1], None]))
    vote = _vote(np.tanh((as_high - as_low)[:, 0] / 2) * on_if_high[changes])
    if abs(vote) > _CLEAR:
        return Telegraph(short, long, share) if vote > 0 else Telegraph(long, short, share)
    low, high_end = min(short.low, long.low), max(short.high, long.high)
    return Telegraph(replace(short, low=low, high=high_end), replace(long, low=low, high=high_end), share)


def _vote(votes: Floats) -> float:
    """The sum of (pixels,) votes for or against, in standard deviations of what it is where each has either sign by
    chance; 0 for none."""
    return float(votes.sum() / max(math.sqrt(np.square(votes).sum()), _TINY))


def _seen(high: Bools, which: Indices, times: int) -> Floats:
    """(pixels, 2 + 4 x times): whether it began low, high; how often it was low after low, high after low, low after
    high and high after high, over each time."""
    before, after = high[:-1], high[1:]
    counts = [
        np.stack([both[which == k].sum(axis=0) for k in range(times)])
        for both in (~before & ~after, ~before & after, before & ~after, before & after)
    ]
    return np.concatenate([~high[:1], high[:1], *counts]).T.astype(np.float64)


def _likelihoods(
    seen: Floats, times: Floats, passed: Floats, asked: Indices, on: Floats, off: Floats
) -> tuple[Floats, Floats]:
    """Log likelihood, minus infinity where on is the longer, and the share of pixels that change: (on, off) each."""
    shorter = on[:, None] <= off
    ons, offs = (axis[shorter] for axis in np.meshgrid(on, off, indexing="ij"))
    laws = _laws(times, ons, offs)
    step = max(_AT_ONCE // len(seen), 1)
    parts = [slice(first, first + step) for first in range(0, len(ons), step)]
    found = np.concatenate([np.logaddexp(*(seen @ law[:, part] for law in laws)).sum(axis=0) for part in parts])
    often = seen[:1, 2:].reshape(4, -1).sum(axis=0)
    share = ons / (ons + offs)
    kept = np.exp(-times[:, None] * (1 / ons + 1 / offs))
    stay = [np.exp(often @ np.log(np.maximum(1 - left * (1 - kept), _TINY))) for left in (share, 1 - share)]
    changing = np.maximum(1 - (1 - share) * stay[0] - share * stay[1], _TINY)
    likely, share_of_all = np.full(shorter.shape, -np.inf), np.ones(shorter.shape)
    # Of all that would go to and fro so, those are not there that were not found.
    likely[shorter] = found - log_occupied(passed, asked, ons, offs)
    share_of_all[shorter] = changing
    return likely, share_of_all


def _laws(times: Floats, ons: Floats, offs: Floats) -> tuple[Floats, Floats]:
    """Log probabilities of what `_seen` counts, (2 + 4 x times, N), of N times on and off: of pixels that are on where
    they are high, and of those that are where they are low."""
    share = ons / (ons + offs)
    kept = np.exp(-times[:, None] * (1 / ons + 1 / offs))
    up, down = share * (1 - kept), (1 - share) * (1 - kept)  # of the level that is on if it is high
    as_high = [1 - share[None], share[None], 1 - up, up, down, 1 - down]
    as_low = [share[None], 1 - share[None], 1 - down, down, up, 1 - up]
    high, low = (np.log(np.maximum(np.concatenate(law), _TINY)) for law in (as_high, as_low))
    return high, low


def _finer(axis: Floats, near: Bools) -> Floats:
    """A finer axis over what is near the likeliest, and one step more."""
    places = np.flatnonzero(near)
    first, last = max(places[0] - 1, 0), min(places[-1] + 1, len(axis) - 1)
    return np.asarray(np.geomspace(axis[first], axis[last], _FINE))


def _profile(axis: Floats, likely: Floats) -> Measured:
    """The likeliest, and ends one step beyond the last that is likely enough; the upper is infinite where all are."""
    inside = np.flatnonzero(likely > likely.max() - ENDS**2 / 2)
    step = float(axis[1] / axis[0])
    high = math.inf if inside[-1] == len(axis) - 1 else float(axis[inside[-1]]) * step
    return Measured(float(axis[int(np.argmax(likely))]), float(axis[inside[0]]) / step, high)
