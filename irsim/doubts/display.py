"""How counts are shown."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.errors import Notice
from irsim.scenario import Scenario


def odd_greys(scenario: Scenario) -> Iterator[Notice]:
    """An AGC of counts that the camera does not give."""
    doubt = scenario.camera.agc.doubt(scenario.camera.bits)
    if doubt is not None:
        key, why = doubt
        yield Notice(("camera", "agc", key), why)
