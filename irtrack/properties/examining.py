"""One property of one tracker: tried over what is drawn for it, shrunk to the least that breaks it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Any, Literal
from zlib import crc32

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky

from irtrack.errors import told
from irtrack.properties.case import Broken, Case, NotAsked
from irtrack.properties.table import Property
from irtrack.types import Tracker

Profile = Literal["ci", "nightly"]
Verdict = Literal["holds", "broken", "excused", "not asked", "not judged"]

NIGHTLY = 10
"""How many times as many examples, and four times as many seeds, a nightly check takes."""
SEEDS: Mapping[Profile, int] = {"ci": 8, "nightly": 32}


@dataclass(frozen=True)
class Outcome:
    """What came of one property.

    verdict   'excused' is broken by a tracker that is known to; 'not asked' says nothing of this one; 'not judged'
              needs a property that is broken
    why       what was seen and what was allowed, or the reason
    drawn     the least example that breaks it: what was drawn, by name
    scenario  its scene as YAML, where it has one
    """

    property: Property
    verdict: Verdict
    why: str = ""
    drawn: Mapping[str, Any] = field(default_factory=dict)
    scenario: str | None = None


@dataclass
class _Found:
    """What the last failing example was; Hypothesis ends on the least."""

    case: Case | None = None
    why: str = ""


def examined(prop: Property, tracker: Tracker, profile: Profile) -> Outcome:
    """What comes of a property; the same at each call."""
    found, silent = _Found(), set[str]()

    @seed(crc32(prop.name.encode()))  # and not derandomize, which draws anew whenever a line of this changes
    @settings(
        max_examples=max(prop.examples * (NIGHTLY if profile == "nightly" else 1), 1),
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        report_multiple_bugs=False,
        print_blob=False,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.data())
    def example(data: st.DataObject) -> None:
        case = Case(tracker, lambda strategy: data.draw(strategy), SEEDS[profile])
        try:
            with redirect_stdout(sys.stderr):
                prop.check(case)
        except NotAsked as reason:
            silent.add(str(reason))
        except Exception as error:  # whatever a tracker raises breaks what is asked of it
            found.case, found.why = case, str(error) if isinstance(error, Broken) else f"raises {told(error)}"
            raise

    try:
        example()
    except Exception as error:
        if found.case is None:
            raise
        note = "; not at each try" if isinstance(error, Flaky) else ""
        clips = found.case.clips
        return Outcome(prop, "broken", found.why + note, found.case.drawn, clips[0].text if clips else None)
    return Outcome(prop, "not asked", next(iter(silent))) if silent else Outcome(prop, "holds")
