"""Allowed values in words, and documentation of fields."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, create_model

from irsim.config.base import Part, Several
from irsim.config.diagnostics import validate_part
from irsim.config.fields import Items, field_docs
from irsim.config.quantities import AboveZero, Fraction, NotNegative, Pair
from irsim.config.schema import Slot
from irsim.config.yaml_text import parse_yaml
from irsim.errors import InputError


@pytest.mark.parametrize(
    ("hint", "words"),
    [
        (NotNegative, "a number, from 0 to 10000000"),
        (AboveZero | None, "a number, above 0"),
        (Annotated[float, Field(ge=0)], "a number, 0 or more"),
        (Annotated[int, Field(gt=2, le=9)], "a whole number, above 2, at most 9"),
        (bool, "true or false"),
        (Fraction | Literal["auto"], "a number, from 0 to 1 or 'auto'"),
        (Pair, "a list of 2, each a number, from -10000000 to 10000000"),
        (Annotated[tuple[float, float], Items("[low, high]")], "a list of 2 [low, high], each a number"),
        (tuple[int, str], "a list of 2, a whole number; text"),
        (Annotated[Several[int], Field(min_length=2)], "a list, each item a whole number, at least 2 items"),
        (Annotated[str, Field(pattern="^x+$", max_length=3)], "text, at most 3 characters, matching ^x+$"),
    ],
)
def test_allowed_values_in_words(hint: Any, words: str) -> None:
    assert Slot.of(hint).words() == words


class Thing(Part):
    """A part."""

    length: float = 1.0
    """Length, m:
    from end to end."""
    width: float = 1.0
    height: float = 1.0
    """Height, m."""

    def volume(self) -> float:
        """No field."""
        return self.length * self.width * self.height


class Kept(Thing):
    """A part with more fields."""

    height: float = 2.0
    """Height in a shelf, m."""
    gain: Fraction | Literal["auto"] = "auto"
    """Gain."""


def test_the_alternatives_of_a_union_are_one_error() -> None:
    with pytest.raises(InputError) as caught:
        validate_part(parse_yaml("gain: 3", "f"), Kept)
    assert str(caught.value) == "f:1:7: gain: 3 is not allowed; allowed: a number, from 0 to 1 or 'auto'"


def test_the_text_under_a_field_is_its_documentation() -> None:
    assert field_docs(Thing) == {"length": "Length, m:\nfrom end to end.", "height": "Height, m."}
    assert field_docs(Kept) == {**field_docs(Thing), "height": "Height in a shelf, m.", "gain": "Gain."}
    properties = Kept.model_json_schema()["properties"]
    described = {key: value["description"] for key, value in properties.items() if "description" in value}
    assert described == field_docs(Kept)


def test_a_class_without_source_has_no_docs() -> None:
    assert field_docs(create_model("Made", __base__=Kept, colour=(str, "red"))) == field_docs(Kept)
