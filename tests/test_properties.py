"""Each property is broken by a planted tracker that breaks nothing else; sound trackers break none."""

from __future__ import annotations

from typing import Any

import pytest
from planted import PLANTED, Constant, Sound

from irtrack.properties import EXCEPTIONS, PROPERTIES, check, check_tracker
from irtrack.trackers import TRACKERS


def broken(tracker: Any) -> set[str]:
    return {outcome.property.name for outcome in check(tracker) if outcome.verdict == "broken"}


def test_each_property_has_a_planted_tracker_and_says_what_holds() -> None:
    assert list(PLANTED) == list(PROPERTIES)
    assert len(PROPERTIES) >= 25
    assert all(each.says.endswith(".") for each in PROPERTIES.values())


def test_a_sound_tracker_breaks_none_and_is_asked_all() -> None:
    assert {outcome.verdict for outcome in check(Sound())} == {"holds"}


@pytest.mark.parametrize("name", PROPERTIES)
def test_a_planted_tracker_breaks_its_property(name: str) -> None:
    (outcome,) = check(PLANTED[name](), only=[name])
    assert outcome.verdict == "broken"
    assert outcome.why


@pytest.mark.slow
@pytest.mark.parametrize("name", PROPERTIES)
def test_a_planted_tracker_breaks_nothing_else(name: str) -> None:
    assert broken(PLANTED[name]()) == {name}


TRACKING = {
    "follows",
    "start_place",
    "start_size",
    "duplicates",
    "drops",
    "reacquires",
    "says_hidden",
    "says_gone",
    "says_empty",
}


def test_a_constant_box_breaks_what_is_about_tracking() -> None:
    found = {
        outcome.property.name for outcome in check(Constant(), only=sorted(TRACKING)) if outcome.verdict == "broken"
    }
    assert found == TRACKING
