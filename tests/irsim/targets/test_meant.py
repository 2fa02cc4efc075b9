"""Words that people use for kinds are answered by the kind that they will have meant, and read by no scenario."""

from __future__ import annotations

import pytest
from pydantic_core import PydanticCustomError

from irsim.backgrounds import BACKGROUNDS
from irsim.config.base import Family, suggestion
from irsim.targets import SHAPES

FAMILIES = {family.name: family for family in (SHAPES, BACKGROUNDS)}
WORDS = [(name, word) for name, family in FAMILIES.items() for word in family.synonyms]


def told(family: Family, word: str) -> str:
    with pytest.raises(PydanticCustomError) as caught:
        family.find(word)
    return caught.value.message()


@pytest.mark.parametrize(("name", "word"), WORDS)
def test_each_word_is_none_of_the_kinds_and_means_one(name: str, word: str) -> None:
    family = FAMILIES[name]
    assert word == word.lower()
    assert word not in family.kinds
    assert told(family, word).endswith(f"; did you mean '{family.kinds[family.synonyms[word]].kind}'?")


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("quadcopter", "quadrotor"),  # nearer to 'helicopter' by its letters
        ("UAV", "quadrotor"),
        ("drones", "quadrotor"),
        ("jet", "fighter"),
        ("airplane", "airliner"),
        ("helo", "helicopter"),
        ("person", "pedestrian"),
        ("ship", "boat"),
        ("bus", "truck"),
        ("quadcoptr", "quadrotor"),
        ("pont", "point"),
        ("tnk", "tank"),
        ("sar", "car"),  # as near to 'sam'
        ("mank", "tank"),  # as near to 'man'
        ("druck", "truck"),
        ("plare", "flare"),
        ("figater", "fighter"),
    ],
)
def test_targets_are_meant_by_their_names_of_every_day(word: str, kind: str) -> None:
    said = told(SHAPES, word)
    assert said.startswith(f"unknown shape kind '{word}'; allowed: point, fighter, ")
    assert said.endswith(f" or module:Class; did you mean '{kind}'?")


def test_what_nobody_means_is_not_guessed() -> None:
    for word in ("zebra", "smoke", "none", "horse"):
        assert "did you mean" not in told(SHAPES, word)
    assert suggestion("uav", SHAPES.kinds) == ""
