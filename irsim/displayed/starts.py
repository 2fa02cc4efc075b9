"""First guesses of the AGC behind pictures, kind by kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import product

import numpy as np

from irsim.display import Agc, Clahe, Fixed, Linear, Plain, Plateau
from irsim.displayed.knobs import knobs
from irsim.displayed.search import descend
from irsim.displayed.trial import Trial

TIMES = (0.0, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0)
"""Time constants that are tried first, frames: any other is within a factor of 1.5 of one."""
TAILS = (0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
PLATEAUS = (1e-6, 1e-4, 4e-4, 1.6e-3, 6e-3, 0.025, 1.0)
GAINS = (0.02, 0.07, 0.25, 0.8, 2.5, 255.0)
TILES = (*((side, side) for side in (2, 3, 4, 5, 6, 8, 10, 12, 16)), (4, 3), (8, 6), (6, 8), (10, 8), (16, 12))
CLIPS = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0, 10.0, 40.0)
TURNS = 3
"""How often at most the places of `clahe` are looked for with other tails."""

Guess = Callable[[Trial], Iterable[Agc]]


def best(trial: Trial, guesses: Iterable[Agc], few: bool = True) -> Agc:
    """The one of least error."""
    return min(guesses, key=lambda agc: trial.error(agc, few))


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
        yield best(trial, (line.model_copy(update={"time_constant_frames": time}) for line in lines))


def plateau(trial: Trial) -> Iterator[Agc]:
    """For each limit the likeliest plateaus at once, and with a memory: one makes up for the other."""
    for gain in GAINS:
        at_once = [Plateau(plateau=share, gain_limit=gain) for share in PLATEAUS]
        likely = sorted(at_once, key=lambda agc: trial.error(agc, few=True))[:2]
        yield best(
            trial, (agc.model_copy(update={"time_constant_frames": time}) for agc, time in product(likely, TIMES))
        )


def clahe(trial: Trial) -> Iterator[Agc]:
    """Places by few bases, then places and tails by turns; then with these places, for each limit, the likeliest of
    many bases of each kind: limit and base make up for each other, and between limits lie ridges."""
    rough: list[Agc] = [Linear(), next(fixed(trial)), Plateau()]
    tails = [Linear(tails=each) for each in product(TAILS[1::2], TAILS[1::2])]
    firsts = (
        best(trial, (Clahe(base=base, tiles=tiles, clip_limit=clip) for base, tiles, clip in each))
        for each in (product(rough, TILES, CLIPS[1:7:2]), product(tails, TILES, CLIPS[3:4]))
    )
    tiles = best(trial, (_placed(trial, first) for first in firsts))
    assert isinstance(tiles, Clahe)
    lines: list[Agc] = [
        Linear(tails=(low, high), time_constant_frames=time)
        for low, high, time in product(TAILS[::4], TAILS[::4], TIMES[:5:2])
    ]
    if isinstance(tiles.base, Linear):
        lines.append(tiles.base)
    steep: list[Agc] = [
        Plateau(plateau=plateau, gain_limit=gain) for plateau, gain in product(PLATEAUS[1::2], GAINS[1::2])
    ]
    for bases, clip in product((lines, steep, [*fixed(trial)], [*none(trial)]), CLIPS):
        yield best(trial, (tiles.model_copy(update={"base": base, "clip_limit": clip}) for base in bases))


def _placed(trial: Trial, first: Agc) -> Agc:
    """Places and tails by turns, until neither changes: where places are small, wrong tails hide the right places."""
    near = first
    for _ in range(TURNS):
        lined = best(trial, [near, *(_with(near, base=Linear(tails=tails)) for tails in product(TAILS, TAILS))])
        moved = best(trial, [lined, *(_with(lined, tiles=tiles) for tiles in TILES)])
        moved = descend(lambda agc: trial.error(agc, few=True), moved, [knob for knob in knobs(moved) if knob.whole])
        if moved == near:
            break
        near = moved
    return near


def _with(agc: Agc, **changed: object) -> Agc:
    return agc.model_copy(update=changed)


CURVED: tuple[Guess, ...] = (none, fixed, linear, plateau)
"""Of AGCs of one curve for the whole picture, the simplest first."""
