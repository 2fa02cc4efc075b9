"""Every planted tracker breaks one property only; every shipped tracker has its exceptions only."""

from __future__ import annotations

import pytest
from planted import PLANTED

from irtrack.properties import EXCEPTIONS, PROPERTIES, check
from irtrack.registry.table import TRACKERS


@pytest.mark.parametrize("name", PROPERTIES)
def test_planted_tracker_breaks_no_other_property(name: str) -> None:
    assert {each.property.name for each in check(PLANTED[name]()) if each.verdict == "broken"} == {name}


@pytest.mark.parametrize("name", TRACKERS)
def test_shipped_tracker_has_its_exceptions_only(name: str) -> None:
    outcomes = {each.property.name: each.verdict for each in check(name)}
    assert set(outcomes.values()) <= {"holds", "excused", "not asked"}
    assert {prop for prop, verdict in outcomes.items() if verdict == "excused"} == set(EXCEPTIONS.get(name, {}))
