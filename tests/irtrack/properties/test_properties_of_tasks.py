"""Properties of detectors and of trackers of many: each is broken by a planted one; sound ones break none."""

from __future__ import annotations

from typing import Any

import planted_detectors
import planted_many
import pytest
from command_line import Call

import irsim
from irtrack.errors import InputError
from irtrack.properties import PROPERTIES_OF, check, check_tracker
from irtrack.types import Detections

PLANTED: dict[str, Any] = {"detect": planted_detectors.PLANTED, "many": planted_many.PLANTED}
INTERFACE = set(PROPERTIES_OF["many"]) & set(PROPERTIES_OF["detect"]) - {"empty", "order"}
"""Properties that trackers of one target have, too: the same functions, tested by day on those."""
EACH = [
    pytest.param(task, name, marks=[pytest.mark.slow] if name in INTERFACE else [], id=f"{task}-{name}")
    for task, table in PLANTED.items()
    for name in table
]


def test_each_property_has_a_planted_breaker() -> None:
    for task, table in PLANTED.items():
        assert list(table) == list(PROPERTIES_OF[task])  # type: ignore[index]  # these are tasks
        assert all(each.says.endswith(".") for each in PROPERTIES_OF[task].values())  # type: ignore[index]  # as above


@pytest.mark.parametrize(("task", "name"), EACH)
def test_planted_one_breaks_its_property(task: str, name: str) -> None:
    (outcome,) = check(PLANTED[task][name](), only=[name])
    assert outcome.verdict == "broken", outcome.why


@pytest.mark.parametrize(("kind", "why"), [("Twins", "two tracks have the id 1"), ("Narrows", "int64 and uint16")])
def test_ids_are_unique_and_of_one_type(kind: str, why: str) -> None:
    (outcome,) = check(getattr(planted_many, kind)(), only=["ids"])
    assert outcome.verdict == "broken"
    assert why in outcome.why


class Brightest:
    """A person's own tracker of many, on detections."""

    def step(self, detections: Detections) -> list[Any]:
        return [(k, each.box, each.score) for k, each in enumerate(sorted(detections, key=lambda one: -one.score)[:3])]


def hottest(image: Any) -> list[Any]:
    """A person's own detector."""
    row, column = divmod(int(image.argmax()), image.shape[1])
    return [(column, row, 5, 5)]


def images(image: Any) -> Any:
    return image


def test_own_ones_are_told_by_their_methods() -> None:
    (outcome,) = check(Brightest, only=["relabel"])
    assert outcome.verdict == "holds"
    assert {each.property.name: each.verdict for each in check(hottest, only=["empty", "finds", "gain"])} == {
        "finds": "broken",
        "gain": "not asked",
        "empty": "broken",
    }
    (outcome,) = check(images, only=["gentle"])
    assert outcome.why.startswith("raises TrackerError: test_properties_of_tasks:images: frame 0: detect gave an image")
    check_tracker(hottest, only=["gentle"])
    with pytest.raises(InputError, match=r"unknown property 'nees'; allowed: legal, "):
        check_tracker("dog", only=["nees"])


def test_command(bare_call: Call) -> None:
    status, out, _ = bare_call("check", "planted_detectors:Leans", "--only", "flip,gentle", "-o", "out")
    assert status == 1
    assert "flip: mirrored in x: detections are off by 2 px (median); allowed: 0.5" in out
    assert "1 holds, 1 broken" in out
    assert len(irsim.load("out/flip.yaml").targets) == 3
    status, out, err = bare_call("check", "dog:threshold=6", "--only", "empty")
    assert (status, err) == (0, "")
