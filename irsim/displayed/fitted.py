"""The best AGC of each kind behind pictures: a new kind is a line in FITS, and one in KNOBS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

from irsim.camera.agc import Agc
from irsim.camera.agc_local import Unsharp
from irsim.displayed.knobs import TIME, Knob, knobs, own_knobs
from irsim.displayed.search import EXACT, descend
from irsim.displayed.starts import CURVED, Guess, clahe, fixed, linear, masked, none, plateau
from irsim.displayed.trial import Trial
from irsim.measure import ROUNDING

AMOUNTS = (0.5, 1.0, 2.0, 4.0)
SIGMAS = (0.7, 1.2, 2.5, 5.0, 10.0)
STARTS = 6
"""First guesses that are followed."""
ROUGH = 8.0
"""How much coarser a search among few frames ends."""
SHORT = 3
"""Frames of memory that are soon worked out."""
WORTH = 0.9
"""Share to which a mask has to bring down what no curve explains."""

Fits = Callable[[Trial, float], Iterator[Agc]]
"""Of a trial, and the least error of kinds that were tried before."""


def refined(trial: Trial, guess: Guess) -> Agc:
    """From the best of first guesses down to the least error: each among few frames first, then the best among all."""

    def error(agc: Agc) -> float:
        return trial.error(agc, few=True)

    starts = sorted(guess(trial), key=error)[:STARTS]
    near = min((descend(error, start, knobs(start), ROUGH) for start in starts), key=error)
    return _settled(trial, near)


def _settled(trial: Trial, agc: Agc) -> Agc:
    near = _over_ridges(lambda tried: trial.error(tried, few=True), agc)
    return descend(trial.error, near, _closer(near))


def _closer(agc: Agc) -> list[Knob]:
    return [knob.closer() for knob in knobs(agc)]


def _over_ridges(error: Callable[[Agc], float], agc: Agc) -> Agc:
    """From valley to valley, as long as one beside is lower: a knob is turned over a ridge, then all others follow."""
    best, least = agc, error(agc)
    for knob in knobs(agc):
        shifts = [sign * shift for shift in knob.ridges for sign in (1, -1)]
        others = [each for each in knobs(agc) if each != knob]
        while shifts and least > EXACT:
            over = [tried for shift in shifts if (tried := knob.turned(best, shift)) is not None]
            found = min((descend(error, tried, others, ROUGH) for tried in over), key=error, default=best)
            if error(found) >= least:
                break
            best, least = found, error(found)
    return best


def _by(guess: Guess) -> Fits:
    def fits(trial: Trial, _: float) -> Iterator[Agc]:
        yield refined(trial, guess)

    return fits


def _clahe(trial: Trial, _: float) -> Iterator[Agc]:
    """A slow gain makes up for wrong limits and tails: where one is found, the best without it is looked for, too."""
    if trial.is_local:
        near = refined(trial, clahe)
        yield near
        if near.memory:
            (slow,) = (knob for knob in knobs(near) if knob.name == TIME)
            yield _settled(trial, slow.set(near, 0.0) or near)


def _unsharp(trial: Trial, least: float) -> Iterator[Agc]:
    """Around a curve: the mask under which pixels of one count have one grey, and the curves that then fit best. Around
    `clahe`: the mask under which greys are a parabola of the counts in every small patch."""
    mask = _mask(trial, local=False)
    if mask is not None and trial.scatter(mask) < least:  # no curve leaves less than that
        behind = trial.behind(mask)
        for guess in CURVED:
            around = mask.model_copy(update={"base": refined(behind, guess)})
            # With a long memory every trial of another mask would blur all frames again.
            yield around if around.memory > SHORT else descend(trial.error, around, _closer(around), ROUGH)
        if trial.scatter(mask) < ROUNDING:
            return
    if least < ROUNDING:  # it has more numbers than `clahe` alone, and no more to explain
        return
    mask = _mask(trial, local=True)
    if mask is not None and (behind := trial.behind(mask)).is_local:
        near = mask.model_copy(update={"base": refined(behind, clahe)})
        other = refined(trial, lambda _: masked(trial, near))
        yield other if trial.error(other) < trial.error(near) else _settled(trial, near)


def _mask(trial: Trial, local: bool) -> Unsharp | None:
    """The likeliest; None where greys are explained as well without one."""

    def scatter(agc: Agc) -> float:
        return trial.scatter(agc, local)

    masks = [Unsharp(amount=amount, sigma_px=sigma) for amount, sigma in product(AMOUNTS, SIGMAS)]
    start = min(masks, key=scatter)
    found = descend(scatter, start, own_knobs(start))
    if scatter(found) > WORTH * trial.scatter(None, local):
        return None
    assert isinstance(found, Unsharp)
    return found


FITS: dict[str, Fits] = {
    "none": _by(none),
    "fixed": _by(fixed),
    "linear": _by(linear),
    "plateau": _by(plateau),
    "clahe": _clahe,
    "unsharp": _unsharp,
}
"""Of each kind, the simplest first: the AGCs of it that explain pictures best."""
