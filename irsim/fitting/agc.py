"""The AGC of a scenario: as a recording says it, or the default one; counts do not tell it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass

from irsim.camera.displays import Agc
from irsim.config.base import dump
from irsim.recording.write import default_agc
from irsim.types import Source


@dataclass(frozen=True)
class ChosenAgc:
    """The AGC of a scenario, with the reason it was chosen for."""

    agc: Agc
    why: str
    notes: tuple[str, ...]

    @classmethod
    def of(cls, source: Source) -> ChosenAgc:
        usual = default_agc(source.bits)
        agc = source.agc
        if isinstance(agc, Agc) and (source.scenario_text is not None or agc != usual):
            return cls(agc, "as the recording says", ())
        if source.bits <= 8:
            return cls(usual, "the counts are the picture", ("8 bits: the counts are shown as they are",))
        return cls(usual, "the default: counts do not tell it", ("the AGC cannot be read off counts: the default",))

    def lines(self) -> Iterator[str]:
        yield f"agc: {json.dumps(dump(self.agc))}  # {self.why}"
