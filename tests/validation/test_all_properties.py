"""Every planted tracker breaks one property only; every shipped tracker has its exceptions only."""

from __future__ import annotations

from typing import Any

import planted_detectors
import planted_many
import pytest
from planted import PLANTED

from irtrack.detectors import DETECTORS
from irtrack.properties import EXCEPTIONS, PROPERTIES, check
from irtrack.registry.table import MULTI_TRACKERS, TRACKERS

OF_TASKS = {f"many-{name}": kind for name, kind in planted_many.PLANTED.items()} | {
    f"detect-{name}": kind for name, kind in planted_detectors.PLANTED.items()
}
SHIPPED = [*TRACKERS, *MULTI_TRACKERS, *(name for name in DETECTORS if name != "onnx")]
"""All but a network, which has no shipped weights."""


@pytest.mark.parametrize("name", PROPERTIES)
def test_planted_tracker_breaks_no_other_property(name: str) -> None:
    assert {each.property.name for each in check(PLANTED[name]()) if each.verdict == "broken"} == {name}


@pytest.mark.parametrize("name", OF_TASKS)
def test_planted_one_of_another_task_breaks_no_other_property(name: str) -> None:
    kind: Any = OF_TASKS[name]
    broken = {each.property.name for each in check(kind()) if each.verdict == "broken"}
    assert broken == {name.partition("-")[2]}


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_tracker_has_its_exceptions_only(name: str) -> None:
    outcomes = {each.property.name: each.verdict for each in check(name)}
    assert set(outcomes.values()) <= {"holds", "excused", "not asked"}
    assert {prop for prop, verdict in outcomes.items() if verdict == "excused"} == set(EXCEPTIONS.get(name, {}))
