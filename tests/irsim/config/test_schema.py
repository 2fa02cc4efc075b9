"""Allowed values in words, and documentation of fields."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, ValidationError, create_model

from irsim.config import yaml_text
from irsim.config.base import Part, Several
from irsim.config.diagnostics import error_lines
from irsim.config.fields import Items, field_docs
from irsim.config.quantities import AboveZero, Fraction, NotNegative, Pair
from irsim.config.schema import Slot


@pytest.mark.parametrize(
    ("hint", "words"),
    [
        (NotNegative, "a number, from 0 to 10000000"),
        (AboveZero, "a number, above 0"),
        (Annotated[float, Field(ge=0)], "a number, 0 or more"),
        (Fraction, "a number, from 0 to 1"),
        (Annotated[int, Field(gt=2, le=9)], "a whole number, above 2, at most 9"),
        (bool, "true or false"),
        (float | None, "a number"),
        (Literal["a", "b"], "'a', 'b'"),
        (Fraction | Literal["auto"], "a number, from 0 to 1 or 'auto'"),
        (Pair, "a list of 2, each a number, from -10000000 to 10000000"),
        (tuple[float, float], "a list of 2, each a number"),
        (Annotated[tuple[float, float], Items("[low, high]")], "a list of 2 [low, high], each a number"),
        (tuple[int, str], "a list of 2, a whole number; text"),
        (Several[AboveZero], "a list, each item a number, above 0"),
        (Annotated[Several[int], Field(min_length=2)], "a list, each item a whole number, at least 2 items"),
        (Annotated[str, Field(pattern="^x+$", max_length=3)], "text, at most 3 characters, matching ^x+$"),
    ],
)
def test_what_is_allowed_in_plain_words(hint: Any, words: str) -> None:
    assert Slot.of(hint).words() == words


class Mixed(Part):
    gain: Fraction | Literal["auto"] = "auto"


def test_the_alternatives_of_a_union_are_one_error() -> None:
    document = yaml_text.parse_yaml("gain: 3", "f")
    with pytest.raises(ValidationError) as caught:
        Mixed.model_validate(document.value)
    assert error_lines(caught.value, document, Mixed) == [
        "f:1:7: gain: 3 is not allowed; allowed: a number, from 0 to 1 or 'auto'"
    ]


class Thing(Part):
    """A part."""

    length: float = 1.0
    """How long it is, m:
    from end to end."""
    width: float = 1.0
    height: float = 1.0
    """How high, m."""

    def volume(self) -> float:
        """No field."""
        return self.length * self.width * self.height


class Kept(Thing):
    """A part that has more."""

    height: float = 2.0
    """How high in a shelf, m."""
    shelf: int = 0
    """Which shelf."""


def test_the_text_under_a_field_is_its_documentation() -> None:
    assert field_docs(Thing) == {"length": "How long it is, m:\nfrom end to end.", "height": "How high, m."}


def test_docs_of_bases_are_inherited_and_overridden() -> None:
    assert field_docs(Kept) == {**field_docs(Thing), "height": "How high in a shelf, m.", "shelf": "Which shelf."}


def test_the_json_schema_has_field_docs() -> None:
    properties = Kept.model_json_schema()["properties"]
    assert {key: value["description"] for key, value in properties.items() if "description" in value} == field_docs(
        Kept
    )


def test_a_class_without_source_has_no_docs() -> None:
    made = create_model("Made", __base__=Kept, colour=(str, "red"))
    assert field_docs(made) == field_docs(Kept)
