"""Which AGC made pictures of counts, with the tolerances of its numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from irsim.camera.agc import Agc
from irsim.camera.agc_local import NestedAgc, Unsharp
from irsim.config.base import dump
from irsim.displayed.fitted import FITS
from irsim.displayed.knobs import TIME, Knob, Path, knobs, own_knobs
from irsim.displayed.pairs import Pairs, silent
from irsim.displayed.search import EXACT, Tolerance, as_good, tolerance
from irsim.displayed.trial import Trial
from irsim.measure import ROUNDING
from irsim.types import Floats

CHEAPER = 0.02
"""Share of the error by which a kind of more numbers has to be better."""
ROUGHNESS = (0.5, 1.0)
"""Share of its error, and squared greys at most, by which pictures may be worse that are equalised place by place:
their error has valleys of about as much, in which a search ends."""
SLOW = 30.0
"""Frames: of what may be as slow and at once, nothing is known."""
STRANGE_GREYS = 8.0
"""Rms error, greys, above which no kind of ours explains a display: JPEG of quality 85 leaves 1 to 5 (docs/measure.md),
and the nearest wrong kind often more (a line fitted to what a plateau showed: 15)."""


@dataclass(frozen=True)
class FittedDisplay:
    """An AGC that shows counts as they were shown.

    agc         it
    tolerances  its numbers by their paths, ("base", "tails", 0), and how far each may be turned by itself before the
                pictures tell
    rms_grey    what its pictures differ by from those that were shown, greys
    frames      how many pictures were compared
    notes       what could not be told
    """

    agc: Agc
    tolerances: tuple[tuple[Path, Tolerance], ...]
    rms_grey: float
    frames: int
    notes: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Plain values, ready for json.dumps."""
        return {
            "kind": self.agc.kind,
            "agc": dump(self.agc),
            "tolerances": {".".join(map(str, path)): [t.value, t.low, t.high] for path, t in self.tolerances},
            "rms_grey": self.rms_grey,
            "frames": self.frames,
        }


def fit_display(pairs: Pairs, progress: Callable[[int], None] | None = None) -> FittedDisplay | str:
    """The AGC of a kind of ours that shows counts most nearly as they were shown; or why the pictures do not tell it.

    Of kinds that show as much as the best does, the one of fewest numbers. `progress` is called with the number of
    kinds, of `len(FITS)`, that were tried.
    """
    why = silent(pairs)
    if why is not None:
        return why
    trial = Trial(pairs)
    tried: list[tuple[Agc, Floats]] = []
    least = math.inf
    for done, fits in enumerate(FITS.values(), 1):
        tried.extend((agc, trial.errors(agc)) for agc in fits(trial, least))
        least = min(float(errors.mean()) for _, errors in tried)
        if progress is not None:
            progress(done)
        if least <= EXACT:
            break
    if progress is not None:
        progress(len(FITS))
    best = min((errors for _, errors in tried), key=lambda errors: float(errors.mean()))
    trial, agc = _running(trial, _idled(trial, _chosen(tried, best)))
    tolerances = tuple((knob.path, _told(trial, agc, knob)) for knob in knobs(agc))
    rms = float(np.sqrt(trial.errors(agc).mean()))
    return FittedDisplay(
        agc, tolerances, rms, len(pairs.pictures), tuple(_notes(agc, trial.is_whole(agc), rms, tolerances))
    )


def _chosen(tried: list[tuple[Agc, Floats]], best: Floats) -> Agc:
    """Of those that are as good as the best, the one of fewest numbers; of these the better."""
    good = [each for each in tried if each[1] is best or _no_worse(each[1], best)]
    return min(good, key=lambda each: (len(knobs(each[0])), float(each[1].mean())))[0]


def _running(trial: Trial, agc: Agc) -> tuple[Trial, Agc]:
    """The same where the display may have begun with the first frame; else trials by one that had run before, and the
    best of the kind then."""
    least = trial.error(agc)
    if agc.memory == 0 or least <= EXACT:
        return trial, agc
    ran = Trial(replace(trial.pairs, ran=True))
    other = _idled(ran, min(FITS[agc.kind](ran, math.inf), key=ran.error, default=agc))
    return (ran, other) if ran.error(other) < least else (trial, agc)


def _idled(trial: Trial, agc: Agc) -> Agc:
    """The AGC whose numbers do nothing that could as well do nothing."""
    best = trial.errors(agc)
    for knob in knobs(agc):
        idle = None if knob.idle is None else knob.set(agc, knob.idle)
        if idle is not None and _no_worse(trial.errors(idle), best):
            agc = idle
    return agc


def _no_worse(errors: Floats, best: Floats) -> bool:
    return as_good(errors, best, ROUNDING / 8 + CHEAPER * float(best.mean()))


def _told(trial: Trial, agc: Agc, knob: Knob) -> Tolerance:
    """A knob's number with its tolerance: of a mask before a single curve with this free, else the others held."""
    inner = agc
    while isinstance(inner, NestedAgc):
        inner = inner.inner
    if isinstance(agc, Unsharp) and agc.base is inner and knob in own_knobs(agc):
        return tolerance(trial.scatters, agc, knob)
    if not trial.is_whole(agc):
        return tolerance(trial.errors, agc, knob)
    share, most = ROUGHNESS
    return tolerance(trial.errors, agc, knob, min(share * trial.error(agc), most))


def _notes(agc: Agc, whole: bool, rms: float, tolerances: tuple[tuple[Path, Tolerance], ...]) -> Iterator[str]:
    if rms > STRANGE_GREYS:
        beside = ", unless the search ended beside its best numbers" if whole else ""
        yield (
            f"no kind of AGC known here explains the pictures{beside}: {agc.kind} is nearest, "
            f"and its pictures differ from them by {rms:.1f} greys rms"
        )
    for knob, (path, found) in zip(knobs(agc), tolerances, strict=True):
        if path[-1] == TIME and found.low == 0 and found.high >= SLOW:
            yield "how slowly the display follows cannot be told: the scene changes too little"
        else:
            yield from cut_short(knob, found)


def cut_short(knob: Knob, found: Tolerance) -> Iterator[str]:
    """A note where the range of a number ends where the search does, and not by the pictures."""
    name = ".".join(map(str, knob.path))
    if found.high >= knob.most:
        which = "which is none" if knob.most == knob.idle else "as far as is searched"
        yield f"{name} may be anything from {found.low:.3g} on: its range ends at {knob.most:g}, {which}"
    if found.low <= knob.least and knob.least > 0 and not knob.whole:
        yield f"{name} may be anything up to {found.high:.3g}: its range ends at {knob.least:g}, as far as is searched"
