"""Which AGC made pictures of counts, with the intervals of its numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from irsim.display import Agc, Around, Unsharp
from irsim.displayed.fitted import FITS
from irsim.displayed.knobs import Knob, Path, knobs, own_knobs
from irsim.displayed.pairs import Pairs, silent
from irsim.displayed.search import ROUNDING, as_good, interval
from irsim.displayed.trial import Trial
from irsim.kinds import dump
from irsim.measure import Measured
from irsim.types import Floats

EXACT = ROUNDING / 4
"""Mean squared error, greys, below which no other kind is asked: one pixel in fifty is one grey off."""
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
    figures     its numbers by their paths, ("base", "tails", 0), with intervals
    rms_grey    what its pictures differ by from those that were shown, greys
    frames      how many pictures were compared
    notes       what could not be told
    """

    agc: Agc
    figures: tuple[tuple[Path, Measured], ...]
    rms_grey: float
    frames: int
    notes: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Plain values, ready for json.dumps."""
        return {
            "kind": self.agc.kind,
            "agc": dump(self.agc),
            "figures": {".".join(map(str, path)): [m.value, m.low, m.high] for path, m in self.figures},
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
    agc = _chosen(tried)
    figures = []
    for knob in knobs(agc):
        found = _told(trial, agc, knob)
        if knob.idle is not None and found.low <= knob.idle <= found.high:
            agc = knob.set(agc, knob.idle) or agc
            found = Measured(knob.idle, found.low, found.high)
        figures.append((knob.path, found))
    rms = float(np.sqrt(trial.errors(agc).mean()))
    return FittedDisplay(agc, tuple(figures), rms, len(pairs.pictures), tuple(_notes(agc, rms, figures)))


def _chosen(tried: list[tuple[Agc, Floats]]) -> Agc:
    """Of those that are as good as the best, the one of fewest numbers; of these the better."""
    best = min((errors for _, errors in tried), key=lambda errors: float(errors.mean()))
    margin = ROUNDING / 8 + CHEAPER * float(best.mean())
    good = [each for each in tried if each[1] is best or as_good(each[1], best, margin)]
    return min(good, key=lambda each: (len(knobs(each[0])), float(each[1].mean())))[0]


def _told(trial: Trial, agc: Agc, knob: Knob) -> Measured:
    """A knob's number with its interval: of a mask before a single curve with this free, else the others held."""
    inner = agc
    while isinstance(inner, Around):
        inner = inner.inner
    if isinstance(agc, Unsharp) and agc.base is inner and knob in own_knobs(agc):
        return interval(lambda tried: trial.scatters(tried), agc, knob)
    if not trial.is_whole(agc):
        return interval(trial.errors, agc, knob)
    share, most = ROUGHNESS
    return interval(trial.errors, agc, knob, min(share * trial.error(agc), most))


def _notes(agc: Agc, rms: float, figures: list[tuple[Path, Measured]]) -> Iterator[str]:
    if rms > STRANGE_GREYS:
        yield (
            f"no kind of AGC known here explains the pictures: {agc.kind} is nearest, "
            f"and its pictures differ from them by {rms:.1f} greys rms"
        )
    for path, found in figures:
        if path[-1] == "time_constant_frames" and found.low == 0 and found.high >= SLOW:
            yield "how slowly the display follows cannot be told: the scene changes too little"
