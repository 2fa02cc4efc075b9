"""The texts under the fields of a class, and that nobody pays for them or for scipy who does not ask."""

from __future__ import annotations

import subprocess
import sys

import pytest
from pydantic import BaseModel, create_model

from irsim.config.base import Part
from irsim.config.field_docs import meanings


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


def test_the_text_under_a_field_is_its_meaning() -> None:
    assert meanings(Thing) == {"length": "How long it is, m:\nfrom end to end.", "height": "How high, m."}


def test_a_class_has_the_meanings_of_its_bases_and_its_own_win() -> None:
    assert meanings(Kept) == {**meanings(Thing), "height": "How high in a shelf, m.", "shelf": "Which shelf."}


def test_they_are_those_that_pydantic_reads() -> None:
    class Twin(BaseModel, use_attribute_docstrings=True):
        length: float = 1.0
        """How long it is, m:
        from end to end."""
        width: float = 1.0
        height: float = 1.0
        """How high, m."""

    theirs = {name: field.description for name, field in Twin.model_fields.items() if field.description}
    assert theirs == meanings(Twin) == meanings(Thing)


def test_the_json_schema_says_them() -> None:
    properties = Kept.model_json_schema()["properties"]
    assert {key: value["description"] for key, value in properties.items() if "description" in value} == meanings(Kept)


def test_a_class_without_source_has_none_of_its_own() -> None:
    made = create_model("Made", __base__=Kept, colour=(str, "red"))
    assert meanings(made) == meanings(Kept)


HEAVY = ("scipy", "matplotlib", "hypothesis", "jinja2")


@pytest.mark.sampled
@pytest.mark.parametrize("module", ["irsim.scenario.model", "irtrack.registry.table", "irtrack.bench", "irtrack.cli"])
def test_start_up_leaves_out_what_few_commands_need(module: str) -> None:
    told = f"import sys, {module}; print(*(name for name in {HEAVY} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
