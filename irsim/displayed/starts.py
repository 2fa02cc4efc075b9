"""First guesses of the AGC behind pictures, kind by kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from irsim.camera.agc import AdaptiveAgc, Agc, Fixed, Linear, Plain, Plateau
from irsim.camera.agc_local import Clahe, Unsharp
from irsim.displayed.evolved import evolved
from irsim.displayed.knobs import TILES, TIME, Knob, knobs, own_knobs
from irsim.displayed.search import EXACT
from irsim.displayed.trial import Trial

TIMES = (0.0, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0)
"""Time constants that are tried first, frames: any other is within a factor of 1.5 of one."""
TAILS = (0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
PLATEAUS = (1e-6, 1e-4, 4e-4, 1.6e-3, 6e-3, 0.025, 1.0)
GAINS = (0.02, 0.07, 0.25, 0.8, 2.5, 255.0)
LIKELY = {
    "clip_limit": (0.5, 64.0),
    TILES: (1.0, 24.0),
    "tails": (0.0, 0.3),
    "gain_limit": (0.01, 10.0),
    TIME: (0.0, 25.0),
}
"""Ranges in which numbers of `clahe` and its base are looked for; from there a search goes on downhill."""
BASES: tuple[Agc, ...] = (Plain(), Fixed(high=65_535), Linear(), Plateau())
"""What `clahe` may stand before: one of each kind."""
ASIDE = 1.3
"""Factor by which a mask's numbers may be wrong that were found before the places behind it were known."""
NEAR = 9.0
"""Times the least error above which a likely base is followed no further."""
LARGE = 150_000
"""Pixels above which fewer frames are compared at first."""

Guess = Callable[[Trial], Iterable[Agc]]


def best(trial: Trial, guesses: Iterable[Agc]) -> Agc:
    """The one of least error in few frames."""
    return min(guesses, key=lambda agc: trial.error(agc, few=True))


def none(_: Trial) -> Iterator[Agc]:
    yield Plain()


def fixed(trial: Trial) -> Iterator[Agc]:
    """A straight line through the greys of counts that are neither black nor white; or from the least count to the
    greatest."""
    pairs = trial.pairs
    full = 2**pairs.bits - 1
    counts = np.concatenate([pairs.counts[k].ravel() for k in pairs.scored])
    greys = np.concatenate([pairs.pictures[k].ravel() for k in pairs.scored])
    ends = [(float(counts.min()), float(counts.max()))]
    grey = (greys > 5) & (greys < 250)
    if np.count_nonzero(grey) and np.ptp(counts[grey]):
        slope, offset = np.polyfit(counts[grey].astype(np.float64), greys[grey].astype(np.float64), 1)
        if slope > 0:
            ends.append((-offset / slope, (255 - offset) / slope))
    for low, high in ends:
        black = min(max(round(low), 0), full - 1)
        yield Fixed(low=black, high=min(max(round(high), black + 1), 65_535))


def linear(trial: Trial) -> Iterator[Agc]:
    """For each time the likeliest tails: one makes up for the other."""
    lines = [Linear(tails=(low, high)) for low, high in product(TAILS, TAILS)]
    for time in TIMES:
        yield best(trial, (line.model_copy(update={TIME: time}) for line in lines))


def plateau(trial: Trial) -> Iterator[Agc]:
    """For each limit the likeliest plateaus at once, and with a memory: one makes up for the other."""
    for gain in GAINS:
        at_once = [Plateau(plateau=share, gain_limit=gain) for share in PLATEAUS]
        likely = sorted(at_once, key=lambda agc: trial.error(agc, few=True))[:2]
        yield best(trial, (agc.model_copy(update={TIME: time}) for agc, time in product(likely, TIMES)))


def clahe(trial: Trial) -> Iterator[Agc]:
    """With a base of each kind, the likeliest from all over its numbers: limit and base make up for each other, between
    limits lie ridges, and wrong tails hide the right places. Those that are near the best.

    First all at once; then those that may follow slowly, with the best places, for a memory takes long to work out.
    """
    error = _roughly(trial)
    starts = [Clahe(base=base) for base in BASES]
    found = [evolved(error, start, _likely(trial, start, TIME)) for start in starts]
    near = min(found, key=error)
    if error(near) > EXACT:
        slow = [_with(near, base=base) for base in BASES if isinstance(base, AdaptiveAgc)]
        found += [evolved(error, start, _likely(trial, start, TILES)) for start in slow]
    yield from _near(found, error)


def masked(trial: Trial, near: Unsharp) -> Iterator[Agc]:
    """A mask around `clahe`, the mask nearly as given and the places as given, and a base of any kind without a memory:
    a mask that is a little wrong makes the wrong kind explain more. Those that are near the best."""
    error = _roughly(trial)
    mask = [_aside(knob, knob.of(near)) for knob in own_knobs(near)]
    found = []
    for base in BASES:
        start = _with(near, base=_with(near.inner, base=base))
        inner = [knob for knob in _likely(trial, start, TIME, TILES) if knob.path[0] == "base"]
        found.append(evolved(error, start, mask + inner))
    yield from _near(found, error)


def _aside(knob: Knob, value: float) -> Knob:
    return replace(knob, least=max(value / ASIDE, knob.least), most=min(value * ASIDE, knob.most))


def _roughly(trial: Trial) -> Callable[[Agc], float]:
    """Mean squared error over three frames at most."""
    frames = trial.few[:: -3 if trial.pairs.counts[0].size > LARGE else -2]
    return lambda agc: float(trial.errors(agc, frames).mean())


def _near(found: Sequence[Agc], error: Callable[[Agc], float]) -> Iterator[Agc]:
    errors = [error(agc) for agc in found]
    yield from (agc for agc, each in zip(found, errors, strict=True) if each <= NEAR * min(errors))


def _with(agc: Agc, **changed: object) -> Agc:
    return agc.model_copy(update=changed)


def _likely(trial: Trial, agc: Agc, *without: str) -> list[Knob]:
    """Its knobs but for those of some names, within what is likely: counts not farther out than there are, twice."""
    counts = [trial.pairs.counts[k] for k in trial.pairs.scored]
    least, most = int(np.min(counts)), int(np.max(counts))
    ends = least - (most - least), most + (most - least)
    ranges = {**LIKELY, "low": ends, "high": ends}
    likely = []
    for knob in knobs(agc):
        low, high = ranges.get(knob.name, (knob.least, knob.most))
        if knob.name not in without:
            likely.append(replace(knob, least=max(low, knob.least), most=min(high, knob.most)))
    return likely


CURVED: tuple[Guess, ...] = (none, fixed, linear, plateau)
"""Of AGCs of one curve for the whole picture, the simplest first."""
