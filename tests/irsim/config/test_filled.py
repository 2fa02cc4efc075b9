"""Keys that follow from others: what is left out of short texts comes back, whatever else is said."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import pytest
from scenario_text import errors_of

from irsim.backgrounds import BACKGROUNDS, Recorded
from irsim.camera.detectors import DETECTORS, NOISES
from irsim.camera.displays import AGCS
from irsim.camera.frame_loss import FAULTS
from irsim.config.base import Part
from irsim.config.schema import Slot, brief, plain
from irsim.motion import CAMERA_MOTIONS, PATHS
from irsim.occluders import OCCLUDERS
from irsim.recording import record
from irsim.render.stream import Rendering
from irsim.scenario.expectation import EXPECTATIONS
from irsim.scenario.loader import change, loads
from irsim.scenario.model import Scenario
from irsim.scenario.variation import VARIATIONS
from irsim.targets import SHAPES

FAMILIES = (
    *(BACKGROUNDS, DETECTORS, NOISES, AGCS, EXPECTATIONS, FAULTS),
    *(PATHS, CAMERA_MOTIONS, OCCLUDERS, SHAPES, VARIATIONS),
)


def parts(part: type[Part]) -> Iterator[type[Part]]:
    """The part and all that may stand in it."""
    yield part
    for field in part.model_fields.values():
        yield from parts_of(Slot.of(field.annotation, field.metadata))


def parts_of(slot: Slot) -> Iterator[type[Part]]:
    if slot.family is not None:
        for _, kind in slot.family:
            yield from parts(kind)
    elif len(slot.choices) > 1:
        for choice in slot.choices:
            yield from parts_of(choice)
    elif slot.is_list or slot.is_table:
        for item in get_args(slot.annotation):
            if item is not Ellipsis:
                yield from parts_of(Slot.of(item))
    elif (found := slot.part(None)) is not None:
        yield from parts(found)


ALL = list(dict.fromkeys(parts(Scenario)))
FILLING = [part for part in ALL if part.filled.__func__ is not Part.filled.__func__]  # type: ignore[attr-defined]


def test_all_kinds_are_asked_and_some_fill() -> None:
    assert {kind for family in FAMILIES for _, kind in family} <= set(ALL)
    assert {part.__name__ for part in FILLING} >= {"Ground", "Landscape", "Recorded", "Camera"}


def test_nothing_is_filled_in_where_short_texts_cannot_know() -> None:
    """By a validator of a class's own, that is; `_look_inside` notes a digest, which every text has."""
    own = {
        (part.__name__, name)
        for part in ALL
        for name, decorator in part.__pydantic_decorators__.model_validators.items()
        if decorator.info.mode != "after" and name != "_fill"
    }
    assert own == {("Recorded", "_look_inside"), ("Model", "_look_inside")}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One that says its scale."""
    text = "{frames: 1, camera: {size: [16, 16], range_k: [250, 330]}, background: {kind: ground}}"
    return record(Rendering(loads(text)), tmp_path_factory.mktemp("filled") / "scale.mcap")


def is_word(part: type[Part], key: str) -> bool:
    field = part.model_fields[key]
    return get_origin(Slot.of(field.annotation, field.metadata).annotation) is Literal


def candidates(part: type[Part], key: str) -> list[dict[str, Any]]:
    """What a text may say of a key: nothing, its plain default, each word that it may be, one item of a list."""
    field = part.model_fields[key]
    found: list[Any] = [] if field.is_required() else [plain(field.get_default())]
    slot = Slot.of(field.annotation, field.metadata)
    if is_word(part, key):
        found += get_args(slot.annotation)
    if slot.is_list and get_args(slot.annotation)[-1] is Ellipsis:
        item = Slot.of(get_args(slot.annotation)[0])
        if item.family is None and item.part(None) is not None:
            found.append([{}])
    if slot.family is not None:
        found += [{"kind": word} for word, _ in slot.family]
    return [{}, *({key: value} for value in found)]


@pytest.mark.sampled
@pytest.mark.parametrize("part", FILLING)
def test_a_short_text_of_a_part_that_fills_keys_says_the_same(part: type[Part], recording: Path) -> None:
    """Any two of its keys, said or left out, beside any of its words (of an hour, of a preset)."""
    needed = {"file": str(recording)} if part is Recorded else {}
    words = [key for key in part.model_fields if is_word(part, key)]
    others = [key for key in part.model_fields if key not in (*words, *needed)]
    told = 0
    for pair in itertools.combinations(others, 2):
        for said in itertools.product(*(candidates(part, key) for key in (*words, *pair))):
            text: dict[str, Any] = {key: value for each in (needed, *said) for key, value in each.items()}
            try:
                value = part.model_validate(text)
            except ValueError:
                continue
            told += 1
            short = brief(value)
            short.pop("kind", None)
            assert part.model_validate(short) == value, text
    assert told > 20


@pytest.mark.parametrize(
    ("background", "key", "other"),
    [
        ("{kind: ground, hour: day}", "hour", "night"),
        ("{kind: landscape, hour: night}", "hour", "any"),
        ("{kind: landscape, trees: [{}]}", "trees", []),
    ],
)
def test_a_change_brings_what_follows_from_it(background: str, key: str, other: Any) -> None:
    scene = loads(f"background: {background}")
    assert change(scene, {f"background.{key}": other}) == loads(
        f"background: {background}", overrides=[f"background.{key}={other}"]
    )
    assert change(scene, {"frames": 3}).background == scene.background


def test_a_recording_says_its_scale_again_unless_none_is_wanted(recording: Path) -> None:
    scene = f"{{camera: {{size: [16, 16]}}, background: {{kind: recording, file: {recording}RANGE}}}}"
    assert loads(scene.replace("RANGE", "")).background.model_dump()["range_k"] == (250, 330)
    unsaid = loads(scene.replace("RANGE", ", range_k: null"))
    assert change(unsaid, {"frames": 3}).background == unsaid.background
    assert "digest" in brief(unsaid.background)


def test_what_an_hour_cannot_be_is_told_in_a_line() -> None:
    (line,) = errors_of("background: {kind: ground, hour: [day]}")
    assert line.startswith("f.yaml:1:34: background.hour: unknown value a list; allowed: 'any', 'day', 'night'")


def test_an_override_begins_from_the_default_where_a_text_says_null() -> None:
    scene = loads("camera: {noise: null}\nbackground: {kind: ground}", overrides=["camera.noise.white.ratio=2"])
    assert [noise.kind for noise in scene.camera.noise] == ["white"]
