"""The best numbers of one kind of AGC, and how far each may be turned before its pictures are others."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from irsim.camera.agc import Agc
from irsim.displayed.knobs import Knob
from irsim.measure import ROUNDING
from irsim.types import MEDIAN_TO_SIGMA, Floats

EXACT = ROUNDING / 4
"""Mean squared error, greys, below which nothing else is tried: one pixel in fifty is one grey off."""
GROWS = 1.3
"""How much longer a step becomes where it was a good one."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """A number, and how far it may be turned by itself before the pictures tell.

    No interval in which the true one lies: numbers may make up for each other, and compression moves them.
    """

    value: float
    low: float
    high: float


def descend(error: Callable[[Agc], float], start: Agc, turn: Sequence[Knob], rough: float = 1.0) -> Agc:
    """The AGC of the least error that is reached from a start by turning knobs one after the other.

    Hooke and Jeeves, "'Direct search' solution of numerical and statistical problems", J. ACM 8, 1961: steps along
    the axes, then once more as far in the direction that these made together, and shorter steps where none helps.
    Errors of pictures have steps themselves, on which a search by slopes, or by a simplex, ends.

    rough   how much coarser than `Knob.fine` the last step may be
    """
    best, least = start, error(start)
    steps = [knob.step for knob in turn]
    while least > 0 and any(step >= _last(knob, rough) for step, knob in zip(steps, turn, strict=True)):
        before, improved = best, False
        for i, knob in enumerate(turn):
            for sign in (1, -1):
                tried = knob.turned(best, sign * steps[i])
                if tried is not None and (found := error(tried)) < least:
                    best, least, improved = tried, found, True
                    steps[i] *= sign * GROWS
                    break
            steps[i] = abs(steps[i])
        if not improved:
            steps = [step / 2 for step in steps]
            continue
        further = _further(before, best, turn)
        if further is not None and (found := error(further)) < least:
            best, least = further, found
    return best


def _last(knob: Knob, rough: float) -> float:
    return knob.fine if knob.whole else rough * knob.fine


def _further(before: Agc, now: Agc, turn: Sequence[Knob]) -> Agc | None:
    """As far again from `now` as it is from `before`."""
    moved: Agc = now
    changed = 0
    for knob in turn:
        old, new = knob.of(before), knob.of(now)
        if old == new:
            continue
        by = new - old if knob.whole else math.log((new + knob.soft) / (old + knob.soft))
        tried = knob.turned(moved, by)
        if tried is None:
            return None
        moved, changed = tried, changed + 1
    return moved if changed > 1 else None


def as_good(errors: Floats, best: Floats, margin: float) -> bool:
    """Whether pictures of these mean squared errors, frame by frame, may be as good as the best.

    Their mean is larger by no more than the margin and two standard errors of the difference, which is chance only as
    far as the best leaves something unexplained; and no frame's is larger by four margins and the less of a quarter and
    of four standard deviations above the usual. The usual and deviations are by medians: where something happens in
    a few frames only, these tell, and are no chance.
    """
    more = errors - best
    usual = float(np.median(more))
    spread = min(float(more.std()), MEDIAN_TO_SIGMA * float(np.median(np.abs(more - usual))))
    chance = min(2 * spread / math.sqrt(more.size), float(best.mean()) / 4)
    most = 4 * margin + np.minimum(best / 4, max(usual, 0) + 4 * spread)
    return bool(more.mean() <= margin + chance and np.all(more <= most))


def tolerance(errors: Callable[[Agc], Floats], agc: Agc, knob: Knob, rough: float = 0.0) -> Tolerance:
    """A knob's number, and how far it may be turned, the others held, before the pictures tell.

    They tell by `as_good`, with a margin of the variance of rounding. Ends of numbers that are not whole are
    rounded outwards, to steps of `Knob.fine`.

    rough   squared greys by which they may be worse besides
    """
    best = errors(agc)
    margin = ROUNDING + rough

    def farthest(sign: int) -> float:
        good, step = agc, knob.fine
        if not knob.whole:  # what a search does not tell apart, it cannot tell
            good = knob.turned(agc, sign * knob.fine) or agc
        while (tried := knob.turned(good, sign * step)) is not None:
            if as_good(errors(tried), best, margin):
                good, step = tried, 2 * step
            elif step <= knob.fine:
                # Between the two nobody looked; but whoever did not reach the end of all is not said to.
                exact = knob.whole or knob.of(tried) in (knob.least, knob.most)
                return knob.of(good if exact else tried)
            else:
                step /= 4
                step = max(step, knob.fine)
        return knob.of(good)

    return Tolerance(knob.of(agc), farthest(-1), farthest(1))
