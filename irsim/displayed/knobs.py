"""What of an AGC can be turned: its numbers, on scales on which a step matters as much everywhere."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from pydantic_core import PydanticCustomError

from irsim.camera import AGCS
from irsim.camera.agc import Agc
from irsim.camera.agc_local import NestedAgc
from irsim.config.base import dump

Path = tuple[str | int, ...]
"""Keys and places that lead to a number of an AGC: ("base", "tails", 0)."""


@dataclass(frozen=True)
class Knob:
    """A number of an AGC and the scale on which it is turned.

    least, most   how far it may be turned
    soft          numbers well above it are turned by shares of themselves, those below by shares of it
    whole         it is a whole number, turned by as much everywhere
    step, fine    first and last step of a search: shares, or for whole numbers as many
    idle          what it is where it does nothing, if that can be written: preferred where it shows as much
    ridges        how far it is turned to get into the next valley, where others make up for it
    """

    path: Path
    least: float
    most: float
    soft: float = 0.0
    whole: bool = False
    step: float = 0.4
    fine: float = 0.004
    idle: float | None = None
    ridges: tuple[float, ...] = ()

    @property
    def name(self) -> str:
        """Its key, without those that lead there and a place behind it: `tails` of ("base", "tails", 0)."""
        return next(key for key in reversed(self.path) if isinstance(key, str))

    def of(self, agc: Agc) -> float:
        value: Any = agc
        for key in self.path:
            value = value[key] if isinstance(key, int) else getattr(value, key)
        return float(value)

    def turned(self, agc: Agc, by: float) -> Agc | None:
        """The AGC with this number turned by so much, no farther than it goes; None where that is none or the same."""
        now = self.of(agc)
        new = self.value(self.scaled(now) + by)
        return None if new == now else self.set(agc, new)

    def scaled(self, value: float) -> float:
        """Where a number lies on the scale on which it is turned."""
        return value if self.whole else math.log(value + self.soft)

    def value(self, scaled: float) -> float:
        """The number there, or the nearest that it may be."""
        new = float(round(scaled)) if self.whole else math.exp(scaled) - self.soft
        return min(max(new, self.least), self.most)

    def set(self, agc: Agc, value: float) -> Agc | None:
        """The AGC with this number; None where there is no such AGC."""
        return turned_to(agc, [(self, value)])

    def closer(self) -> Knob:
        """The same knob for a search that begins near its end."""
        return replace(self, step=max(self.step / 8, self.fine))

    def within(self, key: str) -> Knob:
        """The same knob of an AGC that stands under a key of another."""
        return replace(self, path=(key, *self.path))


TIME, TILES = "time_constant_frames", "tiles"
"""Names of knobs that are turned for themselves."""

_TIME = Knob((TIME,), 0, 100, soft=0.5, idle=0, ridges=(0.5, 1.2, 2.4))
_COUNT = Knob((), 0, 65_535, whole=True, step=64, fine=1)
_TAIL = Knob((), 0, 0.499, soft=2e-5, ridges=(0.02, 0.06))  # one hot pixel more, and the other tail follows
_TILES = Knob((), 1, 64, whole=True, step=2, fine=1)

KNOBS: dict[str, tuple[Knob, ...]] = {
    "none": (),
    "fixed": (replace(_COUNT, path=("low",)), replace(_COUNT, path=("high",))),
    "linear": (replace(_TAIL, path=("tails", 0)), replace(_TAIL, path=("tails", 1)), _TIME),
    "plateau": (Knob(("plateau",), 1e-6, 1), Knob(("gain_limit",), 0.001, 255, idle=255), _TIME),
    "clahe": (
        Knob(("clip_limit",), 0.1, 256, ridges=(0.06, 0.15, 0.35)),
        replace(_TILES, path=(TILES, 0)),
        replace(_TILES, path=(TILES, 1)),
    ),
    "unsharp": (Knob(("amount",), 0.02, 20, soft=0.2, ridges=(0.15, 0.4)), Knob(("sigma_px",), 0.3, 20)),
}
"""Of each kind, from the simplest on; what lies around another AGC has that one's besides."""


def knobs(agc: Agc) -> tuple[Knob, ...]:
    """All that can be turned, the outermost first."""
    return tuple(_knobs(agc))


def own_knobs(agc: Agc) -> tuple[Knob, ...]:
    """What can be turned but for what an AGC around another has inside."""
    return KNOBS[agc.kind]


def turned_to(agc: Agc, numbers: Iterable[tuple[Knob, float]]) -> Agc | None:
    """The AGC with these numbers; None where there is no such AGC."""
    changed = agc
    for knob, value in numbers:
        changed = _put(changed, knob.path, round(value) if knob.whole else value)
    try:
        AGCS.parse(dump(changed))
    except PydanticCustomError:  # such as two counts the wrong way round
        return None
    return changed


def _knobs(agc: Agc) -> Iterator[Knob]:
    yield from KNOBS[agc.kind]
    if isinstance(agc, NestedAgc):
        yield from (knob.within("base") for knob in _knobs(agc.inner))


def _put(value: Any, path: Path, new: float) -> Any:
    if not path:
        return new
    key, *rest = path
    if isinstance(key, int):
        return (*value[:key], _put(value[key], tuple(rest), new), *value[key + 1 :])
    return value.model_copy(update={key: _put(getattr(value, key), tuple(rest), new)})
