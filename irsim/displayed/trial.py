"""How far the pictures of an AGC lie from those that were shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import cv2
import numpy as np

from irsim.camera import CURVES
from irsim.camera.agc import AdaptiveAgc, Agc, Histogram, HistogramAgc, Picture, Statistics, histogram
from irsim.camera.agc_local import NestedAgc
from irsim.displayed.pairs import Pairs, Tally, parted, patched, scatter
from irsim.types import Floats, Image

KEPT = 4
"""Sets of looks that are kept: a search goes back and forth between few."""

LOCAL = 0.05
"""Share of what no single curve explains that whole places of 16 x 16 px have in common: JPEG of qualities 50 and 85
makes 0.004 to 0.011, unsharp masking 0.12 to 0.31, CLAHE of 2 x 2 to 16 x 12 places 0.13 to 0.68, through JPEG, too
(the scene of tests/test_displayed.py, also at 96x80 px)."""


class Trial:
    """Tries AGCs on pairs of counts and pictures, by what they really do with the counts.

    It keeps what trials share: the counts as they reach the curve, looks at them, and where the picture is one
    curve of the counts a tally of both, by which its error is known without drawing it.
    """

    def __init__(self, pairs: Pairs) -> None:
        self.pairs = pairs
        self._before: tuple[NestedAgc, ...] = ()
        self._counts: dict[int, Image] = {}
        self._tallies: dict[int, Tally] = {}
        self._pixels: dict[int, Histogram] = {}
        self._looks: dict[Agc, dict[int, Statistics]] = {}

    @cached_property
    def few(self) -> tuple[int, ...]:
        """Half of the scored frames, for first guesses."""
        return self.pairs.scored[::2]

    def error(self, agc: Agc, few: bool = False) -> float:
        """Mean squared error, greys, over the scored frames, or over few of them."""
        return float(self.errors(agc, self.few if few else self.pairs.scored).mean())

    def errors(self, agc: Agc, frames: Sequence[int] | None = None) -> Floats:
        """(S,) mean squared error of each scored frame, greys."""
        around, curve = _peeled(agc)
        self._reach(tuple(each.model_copy(update={"base": None}) for each in around if _changes_counts(each)))
        behind = [each for each in reversed(around) if _changes_picture(each)]
        whole = self.is_whole(agc)
        found = []
        for k in self.pairs.scored if frames is None else frames:
            looks = self._window(curve, k)
            if not whole:
                tally = self._tally(k)
                found.append(tally.error(curve.picture(tally.present, self.pairs.bits, looks)))
                continue
            picture = curve.picture(self._reached(k), self.pairs.bits, looks)
            for each in behind:
                picture = each.postprocess(picture)
            found.append(_apart(picture, self.pairs.pictures[k]))
        return np.array(found)

    def scatter(self, mask: Agc | None = None, local: bool = False) -> float:
        """Variance of few frames' greys that no curve of the counts explains, or of what a mask makes of these.

        local   the curve may be another in each part of the picture
        """
        return float(self.scatters(mask, local, self.few).mean())

    def scatters(self, mask: Agc | None = None, local: bool = False, frames: Sequence[int] | None = None) -> Floats:
        """(S,) the same of each scored frame."""
        pairs, left = self.pairs, patched if local else scatter
        found = []
        for k in pairs.scored if frames is None else frames:
            counts = pairs.counts[k]
            if isinstance(mask, NestedAgc):
                counts = mask.preprocess(counts, pairs.bits)
            found.append(left(counts, pairs.pictures[k]))
        return np.array(found)

    @staticmethod
    def is_whole(agc: Agc) -> bool:
        """Whether an AGC's picture is more than one curve of the counts that reach it."""
        around, curve = _peeled(agc)
        return any(map(_changes_picture, around)) or curve.kind not in CURVES.kinds

    @cached_property
    def is_local(self) -> bool:
        """Whether greys of the same counts differ from place to place, more than what compression leaves."""
        pairs = self.pairs
        shares = [parted(pairs.counts[k], pairs.pictures[k]) for k in self.few]
        return float(np.mean(shares)) > LOCAL

    def behind(self, mask: NestedAgc) -> Trial:
        """Trials of what comes behind a mask that changes the counts."""
        pairs = self.pairs
        changed = np.stack([mask.preprocess(counts, pairs.bits) for counts in pairs.counts])
        return Trial(replace(pairs, counts=changed))

    def _reach(self, before: tuple[NestedAgc, ...]) -> None:
        """Forget what was kept of other counts than those that reach the curve now."""
        if before != self._before:
            self._before, self._counts, self._tallies, self._pixels, self._looks = before, {}, {}, {}, {}

    def _reached(self, k: int) -> Image:
        counts: Image = self.pairs.counts[k]
        if not self._before:
            return counts
        if k not in self._counts:
            for each in self._before:
                counts = each.preprocess(counts, self.pairs.bits)
            self._counts[k] = counts
        return self._counts[k]

    def _tally(self, k: int) -> Tally:
        if k not in self._tallies:
            self._tallies[k] = Tally.of(self._reached(k), self.pairs.pictures[k])
        return self._tallies[k]

    def _window(self, curve: Agc, k: int) -> list[Statistics]:
        """Looks at as many frames before k as the curve remembers, and at k itself; before the first of all, at that
        one, where the display had run before."""
        if not isinstance(curve, AdaptiveAgc):
            return [curve.statistics(self._reached(k), self.pairs.bits)]
        key = curve.model_copy(update={"time_constant_frames": 0.0})
        kept = self._looks.pop(key, {})
        window = [index if index > 0 else 0 for index in range(k - curve.memory, k + 1) if index >= 0 or self.pairs.ran]
        for index in window:
            if index not in kept:
                kept[index] = self._look(curve, index)
        self._looks[key] = kept
        while len(self._looks) > KEPT:
            del self._looks[next(iter(self._looks))]
        return [kept[index] for index in window]

    def _look(self, curve: Agc, k: int) -> Statistics:
        if not isinstance(curve, HistogramAgc):
            return curve.statistics(self._reached(k), self.pairs.bits)
        if k not in self._pixels:
            self._pixels[k] = histogram(self._reached(k), self.pairs.bits).astype(np.int32)
        return curve.histogram_statistics(self._pixels[k], self._reached(k).size)


def _peeled(agc: Agc) -> tuple[list[NestedAgc], Agc]:
    """An AGC's layers, the outermost first, and the one of a single curve that they lie around."""
    around = []
    while isinstance(agc, NestedAgc):
        around.append(agc)
        agc = agc.inner
    return around, agc


def _changes_counts(agc: NestedAgc) -> bool:
    return type(agc).preprocess is not NestedAgc.preprocess


def _changes_picture(agc: NestedAgc) -> bool:
    return type(agc).postprocess is not NestedAgc.postprocess


def _apart(one: Picture, other: Picture) -> float:
    return float(cv2.norm(one, other, cv2.NORM_L2SQR)) / one.size
