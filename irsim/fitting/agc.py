"""How counts are shown, in the words of a scenario."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from irsim.camera.displays import Agc
from irsim.config.base import dump
from irsim.displayed import FittedDisplay, Path, Tolerance
from irsim.fitting.numbers import plain, ranged
from irsim.recording.writer import default_agc
from irsim.types import Source
from irsim.wording import counted

HOW = (
    "give what the camera showed of the same frames (display=PICTURES: a folder of PNG or TIFF, a .npy, a video, a "
    "recording)"
)


@dataclass(frozen=True)
class ChosenAgc:
    """The AGC of a scenario: fitted to pictures, as a recording says it, or the usual one.

    fitted      None where no pictures tell it
    why         where the AGC comes from, where it was not fitted
    """

    agc: Agc
    fitted: FittedDisplay | None
    why: str
    notes: tuple[str, ...]

    @classmethod
    def of(cls, source: Source, display: FittedDisplay | str | None) -> ChosenAgc:
        """`display` is what was fitted to pictures, or why they do not tell it; None where there are none."""
        if isinstance(display, FittedDisplay):
            return cls(display.agc, display, "", display.notes)
        silent = () if display is None else (f"the display cannot be told: {display}",)
        usual = default_agc(source.bits)
        agc = source.agc
        if isinstance(agc, Agc) and (source.scenario_text is not None or agc != usual):
            return cls(agc, None, "as the recording says", silent)
        if source.bits <= 8:
            return cls(usual, None, "the counts are the picture", (*silent, "8 bits: the counts are shown as they are"))
        lacking = () if silent else (f"the display cannot be told without pictures: {HOW}",)
        return cls(usual, None, "the usual one: it cannot be told from counts", (*silent, *lacking))

    def lines(self) -> Iterator[str]:
        """The key `agc` and what stands under it."""
        if self.fitted is None:
            yield f"agc: {json.dumps(dump(self.agc))}  # {self.why}"
            return
        yield "# Ranges under agc are how far each number may be turned by itself before the pictures tell."
        yield f"agc:  # fitted to {counted(self.fitted.frames, 'picture')}, from which its own differ by " + (
            f"{self.fitted.rms_grey:.3g} greys rms"
        )
        yield from _block(dump(self.agc), dict(self.fitted.tolerances), ())


def _block(values: Mapping[str, Any], told: Mapping[Path, Tolerance], above: Path) -> Iterator[str]:
    """Keys with their values, and the tolerances of those that have some."""
    for key, value in values.items():
        path = (*above, key)
        if isinstance(value, Mapping):
            yield f"  {key}:"
            yield from (f"  {line}" for line in _block(value, told, path))
        elif isinstance(value, list | tuple):
            ranges = [_range(told[(*path, k)]) for k in range(len(value)) if (*path, k) in told]
            yield f"  {key}: [{', '.join(map(_word, value))}]" + (f"  # {', '.join(ranges)}" if ranges else "")
        else:
            yield f"  {key}: {_word(value)}" + (f"  # {_range(told[path])}" if path in told else "")


def _word(value: Any) -> str:
    """As YAML reads it."""
    if isinstance(value, float):
        return plain(value, 6)
    return value if isinstance(value, str) else json.dumps(value)


def _range(told: Tolerance) -> str:
    return ranged(told.low, told.high)
