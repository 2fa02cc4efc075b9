"""Keys that follow from others: short texts are complete."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import pytest
from part_tree import parts
from scenario_text import errors_of

from irsim.backgrounds import Recorded
from irsim.config.base import Part
from irsim.config.schema import Slot
from irsim.config.serialization import brief_value, plain_value
from irsim.recording import record
from irsim.render.stream import Rendering
from irsim.scenario.loader import change, loads
from irsim.scenario.model import Scenario

FILLING = [
    part
    for part in parts(Scenario)
    if part.filled.__func__ is not Part.filled.__func__  # type: ignore[attr-defined]
]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording that contains its scale."""
    text = "{frames: 1, camera: {size: [16, 16], range_k: [250, 330]}, background: {kind: ground}}"
    return record(Rendering(loads(text)), tmp_path_factory.mktemp("filled") / "scale.mcap")


def slot_of(part: type[Part], key: str) -> Slot:
    return Slot.of(part.model_fields[key].annotation, part.model_fields[key].metadata)


def candidates(part: type[Part], key: str) -> list[dict[str, Any]]:
    """Return texts for a key: left out, its default, each word or kind that it may be, one item of a list."""
    field, slot = part.model_fields[key], slot_of(part, key)
    found: list[Any] = [] if field.is_required() else [plain_value(field.get_default())]
    if get_origin(slot.annotation) is Literal:
        found += get_args(slot.annotation)
    if slot.is_list and get_args(slot.annotation)[-1] is Ellipsis:
        item = Slot.of(get_args(slot.annotation)[0])
        if item.family is None and item.part(None) is not None:
            found.append([{}])
    if slot.family is not None:
        found += [{"kind": word} for word, _ in slot.family]
    return [{}, *({key: value} for value in found)]


@pytest.mark.parametrize("part", FILLING)
def test_a_short_text_gives_the_equal_part(part: type[Part], recording: Path) -> None:
    """Each key, given or left out, beside each value of keys that are words (an hour, a preset)."""
    needed = {"file": str(recording)} if part is Recorded else {}
    words = [key for key in part.model_fields if get_origin(slot_of(part, key).annotation) is Literal]
    count = 0
    for other in (key for key in part.model_fields if key not in (*words, *needed)):
        for given in itertools.product(*(candidates(part, key) for key in (*words, other))):
            text: dict[str, Any] = {key: value for each in (needed, *given) for key, value in each.items()}
            try:
                value = part.model_validate(text)
            except ValueError:
                continue
            count += 1
            short = brief_value(value)
            short.pop("kind", None)
            assert part.model_validate(short) == value, text
    assert count > 5


@pytest.mark.parametrize(
    ("background", "key", "other"),
    [
        ("{kind: ground, hour: day}", "hour", "night"),
        ("{kind: landscape, hour: night}", "hour", "any"),
        ("{kind: landscape, trees: [{}]}", "trees", []),
    ],
)
def test_a_change_updates_keys_that_follow(background: str, key: str, other: Any) -> None:
    scene = loads(f"background: {background}")
    overridden = loads(f"background: {background}", overrides=[f"background.{key}={other}"])
    assert change(scene, {f"background.{key}": other}) == overridden
    assert change(scene, {"frames": 3}).background == scene.background


def test_a_recording_gives_its_scale_unless_null(recording: Path) -> None:
    scene = f"{{camera: {{size: [16, 16]}}, background: {{kind: recording, file: {recording}RANGE}}}}"
    assert loads(scene.replace("RANGE", "")).background.model_dump()["range_k"] == (250, 330)
    unknown = loads(scene.replace("RANGE", ", range_k: null"))
    assert change(unknown, {"frames": 3}).background == unknown.background
    assert "digest" in brief_value(unknown.background)


def test_a_wrong_hour_is_one_line() -> None:
    (line,) = errors_of("background: {kind: ground, hour: [day]}")
    assert line.startswith("f.yaml:1:34: background.hour: unknown value a list; allowed: 'any', 'day', 'night'")


def test_an_override_of_null_starts_from_the_default() -> None:
    scene = loads("camera: {noise: null}\nbackground: {kind: ground}", overrides=["camera.noise.white.ratio=2"])
    assert [noise.kind for noise in scene.camera.noise] == ["white"]
