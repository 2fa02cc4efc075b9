"""How long what goes to and fro between two levels stays on each, seen only now and then: a random telegraph signal."""

from __future__ import annotations

import numpy as np

from irsim.measure.interval import ENDS, Measured
from irsim.types import Bools, Floats, Indices

_LEAST = 0.1
"""Mean time that is looked for at least, in the shortest time between two frames: what goes to and fro faster is new in
each frame, and does not tell by how much."""
_MOST = 30.0
"""And at most, in the time that is seen: what stays for longer hardly goes to and fro at all."""
_COARSE, _FINE = 60, 80
"""Times along each axis of the grids."""
_WITHIN = 8.0
"""Log likelihood below the most, to where the fine grid reaches: four standard errors where it is normal."""
_AT_ONCE = 4_000_000
"""Pixels times grid points that are worked out together."""


def mean_times(high: Bools, passed: Floats) -> tuple[Measured, Measured] | None:
    """(time on, time off), means, of what is seen high or not (T, pixels), each once at least; None of no pixels.

    passed  (T - 1,) time from each to the next

    All pixels have the same two, each exponential, on the shorter; which level of a pixel is on, nobody knows. Between
    two looks at p from each other it is on again, if it was, by w + (1 - w) e^(-p (1/on + 1/off)), w = on / (on + off)
    (the two-state Markov chain; D. R. Cox and H. D. Miller, "The Theory of Stochastic Processes", 1965, section 4.5).
    The likeliest times over a grid, given that all change while they are seen, and the ends to which the profile of the
    likelihood falls by 1.92.
    """
    high = high[:, (high[1:] != high[:-1]).any(axis=0)]
    if not high.shape[1]:
        return None
    times, which = np.unique(passed, return_inverse=True)
    seen = _seen(high, which, len(times))
    least, most = _LEAST * float(times[0]), _MOST * float(passed.sum())
    on: Floats = np.geomspace(least, most, _COARSE)
    off = on
    likely = _likelihoods(seen, times, on, off)
    near = likely > likely.max() - _WITHIN
    on, off = (_finer(axis, near.any(axis=other)) for axis, other in ((on, 1), (off, 0)))
    likely = _likelihoods(seen, times, on, off)
    return _profile(on, likely.max(axis=1)), _profile(off, likely.max(axis=0))


def _seen(high: Bools, which: Indices, times: int) -> Floats:
    """(pixels, 2 + 4 x times): whether it began low, high; how often it was low after low, high after low, low after
    high and high after high, over each time."""
    before, after = high[:-1], high[1:]
    counts = [
        np.stack([both[which == k].sum(axis=0) for k in range(times)])
        for both in (~before & ~after, ~before & after, before & ~after, before & after)
    ]
    return np.concatenate([~high[:1], high[:1], *counts]).T.astype(np.float64)


def _likelihoods(seen: Floats, times: Floats, on: Floats, off: Floats) -> Floats:
    """Log likelihood (on, off); minus infinity where on is the longer."""
    ons, offs = (axis.ravel() for axis in np.meshgrid(on, off, indexing="ij"))
    share = ons / (ons + offs)
    kept = np.exp(-times[:, None] * (1 / ons + 1 / offs))
    tiny = np.finfo(np.float64).tiny
    up, down = share * (1 - kept), (1 - share) * (1 - kept)  # of the level that is on if it is high
    as_high = [1 - share[None], share[None], 1 - up, up, down, 1 - down]
    as_low = [share[None], 1 - share[None], 1 - down, down, up, 1 - up]
    laws = [np.log(np.maximum(np.concatenate(law), tiny)) for law in (as_high, as_low)]
    step = max(_AT_ONCE // len(seen), 1)
    parts = [slice(first, first + step) for first in range(0, len(ons), step)]
    found = np.concatenate([np.logaddexp(*(seen @ law[:, part] for law in laws)).sum(axis=0) for part in parts])
    # Of all that would go to and fro so, those are not there that did not while they were seen.
    often = seen[:1, 2:].reshape(4, -1).sum(axis=0)
    stay = [np.exp(often @ np.log(np.maximum(1 - left, tiny))) for left in (up, down)]
    found -= len(seen) * np.log(np.maximum(1 - (1 - share) * stay[0] - share * stay[1], tiny))
    return np.where(ons > offs, -np.inf, found).reshape(len(on), len(off))


def _finer(axis: Floats, near: Bools) -> Floats:
    """A finer axis over what is near the likeliest, and one step more."""
    places = np.flatnonzero(near)
    first, last = max(places[0] - 1, 0), min(places[-1] + 1, len(axis) - 1)
    return np.asarray(np.geomspace(axis[first], axis[last], _FINE))


def _profile(axis: Floats, likely: Floats) -> Measured:
    inside = axis[likely > likely.max() - ENDS**2 / 2]
    step = axis[1] / axis[0]
    value = float(axis[int(np.argmax(likely))])
    return Measured(value, float(inside[0] / step), float(inside[-1] * step))
