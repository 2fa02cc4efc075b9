"""Rewrites the generated parts of the documents: `make docs`. Their pictures: `docs/pictures.py`.

A generated part stands between `<!-- generated: name -->` and `<!-- end -->`. The tests compare each
with what this script would write, so the documents list what the code has.
"""

from __future__ import annotations

import inspect
import json
import math
import re
import textwrap
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

from pydantic.fields import FieldInfo

import irsim
import irtrack
from irsim.backgrounds import BACKGROUNDS
from irsim.backgrounds.clouds import Clouds
from irsim.backgrounds.clutter import Clutter
from irsim.backgrounds.ground_cover import Fields, Roads, Water
from irsim.backgrounds.structures import Buildings
from irsim.backgrounds.trees import Trees
from irsim.camera import AGCS, FRAME_FAULTS, NOISES, SENSORS
from irsim.camera.bloom import Bloom
from irsim.camera.camera import Camera
from irsim.camera.drift import Correction
from irsim.camera.motion_blur import MotionBlur
from irsim.camera.vignetting import Vignetting
from irsim.cli.gallery import body_kinds, default_shape, framed
from irsim.config.base import Family, Kind, Name, NamedKind, Part, Switch
from irsim.config.fields import field_docs
from irsim.config.quantities import LARGEST
from irsim.config.schema import Slot
from irsim.config.serialization import plain_value
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.motion import CAMERA_MOTIONS, PATHS
from irsim.occluders import OCCLUDERS
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.lens import Lens
from irsim.physics.turbulence import Turbulence
from irsim.scenario.catalog import examples, shipped
from irsim.scenario.expectation import EXPECTATIONS
from irsim.scenario.loader import load
from irsim.scenario.model import Scenario
from irsim.scenario.variation import VARIATIONS
from irsim.targets import SHAPES
from irsim.targets.flicker import FLICKERS
from irsim.targets.target import Target
from irsim.types import TargetTruth
from irtrack.bench.suite import SuiteFile, SuiteSource, SuiteTracker
from irtrack.metrics import LOSS_RULE
from irtrack.properties import EXCEPTIONS, PROPERTIES
from irtrack.registry.table import TRACKERS

DOCS = Path(__file__).parent

FAMILIES: tuple[Family, ...] = (
    BACKGROUNDS,
    SHAPES,
    FLICKERS,
    PATHS,
    OCCLUDERS,
    CAMERA_MOTIONS,
    SENSORS,
    NOISES,
    FRAME_FAULTS,
    AGCS,
    VARIATIONS,
    EXPECTATIONS,
)

OUTER: dict[str, type[Part]] = {
    "Scenario": Scenario,
    "camera": Camera,
    "correction, in `camera`": Correction,
    "optics, in `camera`": Lens,
    "smear, in `camera`": MotionBlur,
    "falloff, in `camera`": Vignetting,
    "bloom, in `camera`": Bloom,
    "targets: each": Target,
    "atmosphere": Atmosphere,
    "turbulence, in `atmosphere`": Turbulence,
}
"""Parts of a scenario, and where they stand."""

INNER: dict[str, type[Part]] = {
    "clouds: each, in `background: {kind: sky}`": Clouds,
    "fields, in `background: {kind: ground}` and `{kind: landscape}`": Fields,
    "roads, in `background: {kind: ground}` and `{kind: landscape}`": Roads,
    "water, in `background: {kind: ground}` and `{kind: landscape}`": Water,
    "clutter, in `background: {kind: ground}` and `{kind: landscape}`": Clutter,
    "trees: each, in `background: {kind: landscape}`": Trees,
    "buildings: each, in `background: {kind: landscape}`": Buildings,
}
"""Parts of backgrounds, and where they stand."""

SUITE_PARTS: dict[str, type[Part]] = {
    "Suite": SuiteFile,
    "sources: each": SuiteSource,
    "trackers: each": SuiteTracker,
}
"""Parts of a suite, and where they stand."""


BOUNDS = {
    f", from -{LARGEST} to {LARGEST}": "",
    f", from 0 to {LARGEST}": ", 0 or more",
    f", from 1e-06 to {LARGEST}": ", above 0",
}
"""Bounds that the text says of all numbers, and what the tables say for them."""


def keys(part: type[Part]) -> Iterator[str]:
    """A table row for each key of a part; `id` of things in lists is explained once in the text."""
    yield "| key | allowed | default | meaning |"
    yield "| --- | --- | --- | --- |"
    for name, field in part.model_fields.items():
        if not (name == "id" and issubclass(part, NamedKind)):
            words = (allowed(Slot.of(field.annotation, field.metadata)), default(field), field_docs(part).get(name, ""))
            yield f"| `{name}` | " + " | ".join(map(cell, words)) + " |"


def allowed(slot: Slot) -> str:
    """What may stand in a place, shorter than an error would say it."""
    item = slot.child([], 0) if slot.is_list else None
    several = item is not None and get_args(slot.annotation)[-1] is Ellipsis
    if several and item is not None and (item.family or item.part(None)):
        return f"a list, each {allowed(item)}"
    if slot.is_table:
        inner = get_args(slot.annotation)[1]
        return "a mapping" if inner is Any else f"a mapping, under each key {allowed(Slot.of(inner))}"
    if slot.family is not None:
        return f"a kind of {slot.family.name}, see below"
    if slot.part(None) is not None:
        return "a mapping, see below"
    words = slot.words().replace(Slot.of(Name).words(), "a name")
    words = words.replace(Slot.of(Switch).words(), "a name, or NAME.WHAT (see above)")
    for bounds, short in BOUNDS.items():
        words = words.replace(bounds, short)
    return words


def default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None:
        return ""
    if isinstance(value, tuple) and value and all(isinstance(item, Kind) for item in value):
        return "`[" + ", ".join(f"{{kind: {item.kind}}}" for item in value) + "]`"
    if isinstance(value, Kind):
        return f"`{{kind: {value.kind}}}`"
    return "its keys' defaults" if isinstance(value, Part) else f"`{json.dumps(plain_value(value))}`"


def cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def first_sentence(part: type) -> str:
    text = " ".join((part.__doc__ or "").split())
    return re.split(r"(?<=\.) ", text)[0]


def scenario_keys() -> Iterator[str]:
    for title, part in {**OUTER, **INNER}.items():
        yield f"### {title}\n"
        yield from keys(part)
        yield ""
    for family in FAMILIES:
        yield f"### {family.name} kinds\n"
        for name, kind in family:
            yield f"`kind: {name}`: {first_sentence(kind)}\n"
            if set(kind.model_fields) - {"id"}:
                yield from keys(kind)
                yield ""


def example_list() -> Iterator[str]:
    yield "| name | what it is for |"
    yield "| --- | --- |"
    for name in sorted(examples()):
        yield f"| `{name}` | {cell(load(name).about)} |"


def source_scenes() -> Iterator[str]:
    yield "| name | what it shows |"
    yield "| --- | --- |"
    for name in sorted(shipped("sources")):
        yield f"| `sources/{name}` | {cell(load(f'sources/{name}').about)} |"


def stress_list() -> Iterator[str]:
    yield "| name | what grows | values from severity 0 to 5 |"
    yield "| --- | --- | --- |"
    for name in sorted(shipped("stress")):
        scenario = load(f"stress/{name}")
        values = "; ".join(
            f"`{key}`: {json.dumps(plain_value(levels))[1:-1]}" for key, levels in scenario.severities.items()
        )
        if values:
            cause = scenario.about.removeprefix("Stress: ").partition(";")[0]
            yield f"| `stress/{name}` | {cause} | {cell(values)} |"


def tracker_keys() -> Iterator[str]:
    for name, tracker in TRACKERS.items():
        yield f"### {name}\n"
        yield f"{first_sentence(tracker)} Source: {tracker.source}.\n"
        yield from keys(tracker)
        yield ""


def suite_keys() -> Iterator[str]:
    for title, part in SUITE_PARTS.items():
        yield f"### {title}\n"
        yield f"{' '.join((part.__doc__ or '').split())}\n"
        yield from keys(part)
        yield ""


def property_list() -> Iterator[str]:
    yield "| property | what holds |"
    yield "| --- | --- |"
    for each in PROPERTIES.values():
        yield f"| `{each.name}` | {cell(each.says)} |"


def truth_fields() -> Iterator[str]:
    """From the docstring: a name or several, and what follows, in lines that begin in the same column."""
    yield "| field | what |"
    yield "| --- | --- |"
    listed = inspect.cleandoc(TargetTruth.__doc__ or "").split("\n\n")[1]
    for names, text in re.findall(r"^(\w+(?:, \w+)*) +(\S.*(?:\n +.*)*)", listed, re.M):
        yield f"| {', '.join(f'`{name}`' for name in names.split(', '))} | {cell(' '.join(text.split()))} |"


def exception_list() -> Iterator[str]:
    yield "| tracker | property | reason |"
    yield "| --- | --- | --- |"
    for tracker, reasons in EXCEPTIONS.items():
        for name, reason in reasons.items():
            yield f"| `{tracker}` | `{name}` | {cell(reason)} |"


def centre_offsets() -> Iterator[str]:
    """How far the area centroid of each body lies from the middle of its box, drawn in the poses of `irsim gallery`."""
    yield "| kind | across, of the box's width | down, of its height | both, of its diagonal |"
    yield "| --- | --- | --- | --- |"
    worst = []
    for kind in body_kinds():
        shape = default_shape(kind)
        sprites = [framed(shape, pose, CENTRE_STAGE, 0.0) for pose in shape.picture_poses]
        across = max(abs(sprite.center[0] - sprite.box.cx) / sprite.box.w for sprite in sprites)
        down = max(abs(sprite.center[1] - sprite.box.cy) / sprite.box.h for sprite in sprites)
        both = max(math.dist(sprite.center, (sprite.box.cx, sprite.box.cy)) / sprite.box.diagonal for sprite in sprites)
        worst.append((both, f"| {kind} | {100 * across:.0f} % | {100 * down:.0f} % | {100 * both:.0f} % |"))
    yield from (line for _, line in sorted(worst, reverse=True))


CENTRE_STAGE = SceneContext(0, Geometry((256, 256), 5e-4), 30.0, "lwir", 0.6, ambient=30.0)
"""A camera that draws bodies large enough to measure them."""


def loss_rule() -> Iterator[str]:
    yield from textwrap.wrap(f"**Lost.** {LOSS_RULE}", 100)


def public_names(package: ModuleType) -> Iterator[str]:
    """A table row for each public name of a package: the first sentence of its docstring."""
    yield "| name | what it is |"
    yield "| --- | --- |"
    for name in package.__all__:
        value = getattr(package, name)
        text = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split()) if callable(value) else ""
        choices = ", ".join(map(repr, get_args(value)))
        sentence = re.split(r"(?<=\.) (?=[A-Z`])", text)[0] if text else f"One of {choices}."
        yield f"| `{package.__name__}.{name}` | {cell(sentence)} |"


PARTS: dict[str, Callable[[], Iterator[str]]] = {
    "scenario keys": scenario_keys,
    "examples": example_list,
    "source scenes": source_scenes,
    "stresses": stress_list,
    "tracker parameters": tracker_keys,
    "suite keys": suite_keys,
    "properties": property_list,
    "exceptions": exception_list,
    "loss rule": loss_rule,
    "centre offsets": centre_offsets,
    "truth fields": truth_fields,
    "names of irsim": partial(public_names, irsim),
    "names of irtrack": partial(public_names, irtrack),
}


def generated(text: str) -> str:
    """A document with its generated parts as they should be."""

    def fill(match: re.Match[str]) -> str:
        return f"<!-- generated: {match[1]} -->\n" + "\n".join(PARTS[match[1]]()).strip() + "\n<!-- end -->"

    return re.sub(r"<!-- generated: ([a-z ]+) -->\n.*?<!-- end -->", fill, text, flags=re.DOTALL)


def main() -> None:
    for path in sorted(DOCS.glob("*.md")):
        path.write_text(generated(path.read_text()))


if __name__ == "__main__":
    main()
