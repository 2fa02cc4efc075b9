"""Whether a background's texture lies where that of real infrared recordings does."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from irsim.errors import InputError
from irsim.measure.spectrum import Texture

Bounds = tuple[float, float]

_SLOPE = 0.2
"""How far beta may lie beyond recordings of a sort: thin cloud has 3.8 in one of them, 3.6 in another."""
_AXIS = 0.35
"""The same along one axis, where pictures of one and the same spectrum differ by as much already."""
_SPREAD = 1.25
"""The same of spreads, a factor: ground from the air has 32 by day and 25 by night."""
_ROWS = 0.2
"""The same of the share of rows, which few sequences tell."""
_UNEVEN = 1.4
"""The same of how unevenly texture lies, a factor, for as few sequences tell it."""
BEND = (-1.0, 1.0)
"""Real backgrounds are straight in log-log: 0.0 to 0.1 in three sequences, -0.2 to 0.2 in their single frames; blurred
white noise has 1.4 and more. Pictures of one and the same spectrum differ by 0.4."""


@dataclass(frozen=True)
class Real:
    """What recordings of a class measure, from the least to the most.

    beta, beta_x, beta_y    exponents of the power spectrum: over all directions, along x, along y
    spread                  standard deviation of grey levels, of 255
    rows                    share of its square that is between rows; any where no sequence tells it
    uneven                  how unevenly the texture lies; not judged where no sequence tells it
    """

    beta: Bounds
    beta_x: Bounds
    beta_y: Bounds
    spread: Bounds
    rows: Bounds = (0.0, 1.0)
    uneven: Bounds | None = None

    def ranges(self) -> dict[str, Bounds]:
        """Figure -> where it may lie: the class's values, widened by how far recordings of one sort differ."""
        found = {
            "beta": (self.beta[0] - _SLOPE, self.beta[1] + _SLOPE),
            "beta_x": (self.beta_x[0] - _AXIS, self.beta_x[1] + _AXIS),
            "beta_y": (self.beta_y[0] - _AXIS, self.beta_y[1] + _AXIS),
            "bend": BEND,
            "spread": (self.spread[0] / _SPREAD, self.spread[1] * _SPREAD),
            "rows": (max(self.rows[0] - _ROWS, 0.0), min(self.rows[1] + _ROWS, 1.0)),
        }
        if self.uneven is not None:
            found["uneven"] = self.uneven[0] / _UNEVEN, self.uneven[1] * _UNEVEN
        return found


CLASSES = {
    "cloud": Real((2.9, 4.1), (2.2, 3.2), (3.1, 4.7), (19, 42), uneven=(0.58, 1.24)),
    "horizon": Real((3.6, 3.6), (2.9, 2.9), (4.0, 4.0), (68, 68), (0.88, 0.92), (1.24, 1.46)),
    "trees": Real((2.2, 2.5), (2.2, 2.2), (1.9, 2.4), (42, 61), (0.1, 0.1), (1.31, 1.31)),
    "treeline": Real((2.2, 3.8), (1.1, 2.9), (1.9, 4.0), (50, 68), (0.88, 0.92), (1.24, 1.46)),
    "ground": Real((2.3, 2.9), (1.8, 2.7), (2.1, 2.75), (12.5, 32)),
    "city": Real((2.4, 2.4), (2.2, 2.2), (2.4, 2.4), (33, 33)),
}
"""Medians of infrared recordings, measured by the project over 4/N .. 0.2 cycles a px; spreads are those of tiles.

cloud: thin, thick and broken cloud, one sequence without compression. ground: from the air by day and
night, at long range, a park. treeline: between bare trees and horizon with field.

Three sequences of Svanstrom et al., "A dataset for multi-sensor drone detection" (Data in Brief 2021), widen these,
measured as `irsim realism` does, their targets taken out:

thin cloud over a bright horizon    beta 3.6, 2.9 / 2.8, spread 42, rows 0.88, uneven 1.24
the same above the horizon alone    beta 3.8, 2.7 / 3.1, spread 17, rows 0.33, uneven 0.58
a line of hot trees                 beta 3.8, 1.1 / 4.0, spread 50, rows 0.92, uneven 1.46
bare trees before the sky           beta 2.5, 2.2 / 2.4, spread 42, rows 0.10, uneven 1.31

Rows and uneven are theirs alone. Of cloud, beta_y is that above the horizon; its spread there is left out.
"""

_PLACES = 6
"""Decimals of a printed figure, at most."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """One figure beside the range of a class; outside where all of its own interval is, if it has one."""

    figure: str
    value: float
    low: float
    high: float
    interval: Bounds | None = None

    @property
    def inside(self) -> bool:
        least, most = self.interval or (self.value, self.value)
        return least <= self.high and most >= self.low

    @property
    def measured(self) -> str:
        """The value to hundredths; of one outside, to as many places as tell it from the end that it is beyond."""
        places = 2
        while not self.inside and self.low <= float(f"{self.value:.{places}f}") <= self.high and places < _PLACES:
            places += 1
        return f"{self.value:z.{places}f}"

    @property
    def allowed(self) -> str:
        return f"{self.low:.2f} to {self.high:.2f}"


@dataclass(frozen=True)
class Judged:
    """What is measured beside the ranges of all names that are known: classes of backgrounds, or sorts of camera.

    figures     by name what is measured, as text for people where no name is asked for
    beside      name -> each figure beside its range
    asked       the name to be judged by, if any
    beyond      what stands in the texts behind the values
    """

    figures: Mapping[str, str]
    beside: Mapping[str, tuple[Verdict, ...]]
    asked: str | None
    beyond: str = ""

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each figure beside the range of the name that is asked for."""
        return () if self.asked is None else self.beside[self.asked]

    @property
    def apart(self) -> dict[str, tuple[Verdict, ...]]:
        """Name -> the figures that keep it out, of those that do not fit."""
        kept = {name: tuple(each for each in verdicts if not each.inside) for name, verdicts in self.beside.items()}
        return {name: verdicts for name, verdicts in kept.items() if verdicts}

    @property
    def fitting(self) -> tuple[str, ...]:
        """Names whose ranges hold all figures."""
        return tuple(name for name in self.beside if name not in self.apart)

    def lines(self, head: str, none: str) -> Iterator[str]:
        """For people: the figures beside the ranges asked for, or alone; after `head` the names that fit, or `none`;
        and of none asked for also what keeps it out of the others, and where that would have to lie."""
        yield f"{'figure':11} measured  {self.beyond if self.asked is None else f'allowed for {self.asked}'}".rstrip()
        if self.asked is None:
            for figure, text in self.figures.items():
                yield f"{figure:11} {text}"
        for each in self.verdicts:
            word = "ok" if each.inside else "OUTSIDE"
            yield f"{each.figure:11} {each.measured:>8}  {each.allowed}  {word}"
        yield f"{head}: {', '.join(self.fitting) or none}"
        if self.asked is None:
            for name, verdicts in self.apart.items():
                kept = (f"{each.figure} {each.measured} (allowed {each.allowed})" for each in verdicts)
                yield f"  not {name}: {', '.join(kept)}"


def judge(found: Texture, like: str) -> tuple[Verdict, ...]:
    """Each figure beside the range of the class. InputError where there is no such class."""
    check_class(like)
    return tuple(
        Verdict(figure, getattr(found, figure), low, high) for figure, (low, high) in CLASSES[like].ranges().items()
    )


def judge_classes(found: Texture, like: str | None = None) -> Judged:
    """A texture beside all classes. InputError where there is no class `like`."""
    if like is not None:
        check_class(like)
    figures = {figure: f"{getattr(found, figure):z8.2f}" for figure in Texture.__slots__}
    return Judged(figures, {name: judge(found, name) for name in CLASSES}, like)


def check_class(like: object) -> None:
    """InputError where there is no such class."""
    if not (isinstance(like, str) and like in CLASSES):
        raise InputError(f"like {reprlib.repr(like)}: no such class; allowed: {', '.join(CLASSES)}")
