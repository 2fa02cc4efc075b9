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
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, get_args

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
from irsim.camera.detail import DetailEnhancement
from irsim.camera.drift import Correction
from irsim.camera.encoding import H264
from irsim.camera.motion_blur import MotionBlur
from irsim.camera.temporal_filter import TemporalFilter
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
from irtrack.properties import EXCEPTIONS, PROPERTIES, PROPERTIES_OF
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
    "noise_reduction, in `agc`": TemporalFilter,
    "detail, in `agc`": DetailEnhancement,
    "encoding, in `agc`": H264,
    "targets: each": Target,
    "atmosphere": Atmosphere,
    "turbulence, in `atmosphere`": Turbulence,
}
"""Parts of a scenario, and where they stand."""

INNER: dict[str, type[Part]] = {
    "**clouds** (each; of `sky`, `landscape`, `sea`)": Clouds,
    "**fields** (of `ground`, `landscape`)": Fields,
    "**roads** (of `ground`, `landscape`)": Roads,
    "**water** (of `ground`, `landscape`)": Water,
    "**clutter** (of `ground`, `landscape`)": Clutter,
    "**trees** (each; of `landscape`)": Trees,
    "**buildings** (each; of `landscape`)": Buildings,
}
"""Parts of backgrounds, and where they stand."""

SUITE_PARTS: dict[str, type[Part]] = {
    "Suite": SuiteFile,
    "sources: each": SuiteSource,
    "trackers: each": SuiteTracker,
}
"""Parts of a suite, and where they stand."""


SHORTER = (
    (r"\ban? whole number", "integer"),
    (r"\ban? number, ", ""),
    (r"\ban? number\b", "number"),
    (rf"from -{LARGEST} to {LARGEST}", "number"),
    (rf"from 0 to {LARGEST}", "0 or more"),
    (rf"from 1e-06 to {LARGEST}", "above 0"),
    (rf"from (\S+) to {LARGEST}", r"\1 or more"),
    (r", from (\S+) to (\S+)", r" \1…\2"),
    (r"from (\S+) to (\S+)", r"\1…\2"),
    (r"([\d.e-]+) or more", r"≥ \1"),
    (r"above (?=[\d.])", "> "),
    (r"below (?=[\d.])", "< "),
    (r"at most (?=[\d.])", "≤ "),
    (r"\b(integer|text|number), ", r"\1 "),
    (r"\ban? list of (\d+), each", r"\1 of:"),
    (r"\ban? list of \d+[, ]\s*([^;\[]+;.*?)(?=, at|$)", lambda found: f"[{found[1].replace('; ', ', ')}]"),
    (r"\ban? list, each(?: item)?", "list of:"),
    (r"\ban? mapping, under each key", "mapping to:"),
    (r"\ba (name|mapping)", r"\1"),
    (r"true or false", "boolean"),
)
"""Phrases of an error message, and their short forms in a table."""


class Key(NamedTuple):
    """Row of a table of keys."""

    name: str
    default: str
    allowed: str
    meaning: str

    @property
    def variant(self) -> tuple[str, str, str]:
        """All of it except the default: keys of one variant are printed once."""
        return self.name, self.allowed, self.meaning

    @property
    def setting(self) -> str:
        """The key with its default, as YAML."""
        if not self.default or self.default == "required":
            return f"`{self.name}`" + (", required" if self.default else "")
        return f"`{self.name}: {self.default}`"


def keys_of(part: type[Part]) -> list[Key]:
    """Return the keys of a part; the `id` of list items is explained once in the text."""
    texts = field_docs(part)
    return [
        Key(name, default(field), allowed(Slot.of(field.annotation, field.metadata)), cell(texts.get(name, "")))
        for name, field in part.model_fields.items()
        if not (name == "id" and issubclass(part, NamedKind))
    ]


def table(keys: Iterable[Key]) -> Iterator[str]:
    """Yield a Markdown table of keys."""
    yield "key: default | allowed | meaning"
    yield "--- | --- | ---"
    for key in keys:
        yield f"{cell(key.setting)} | {cell(key.allowed)} | {key.meaning}"
    yield ""


def group(heading: str, parts: dict[str, tuple[str, type[Part]]]) -> Iterator[str]:
    """Yield the keys of several parts (title to sentence and class): first those that several share, then the others.

    A key is shared where name, allowed values and text are equal. A default that differs stands with each part.
    """
    listed = {title: keys_of(part) for title, (_, part) in parts.items()}
    variants = Counter(key.variant for keys in listed.values() for key in keys)
    shared: dict[str, tuple[str, str, str]] = {}
    for variant, number in variants.most_common():
        if number > 1:
            shared.setdefault(variant[0], variant)
    defaults: dict[str, set[str]] = {}
    for key in (key for keys in listed.values() for key in keys if key.variant == shared.get(key.name)):
        defaults.setdefault(key.name, set()).add(key.default)
    if shared:
        yield f"Keys that several {heading} share:\n"
        yield from table(
            Key(name, next(iter(defaults[name])) if len(defaults[name]) == 1 else "", accepted, meaning)
            for name, accepted, meaning in shared.values()
        )
    common = {name for name, variant in shared.items() if variants[variant] == len(parts) and len(defaults[name]) == 1}
    for title, (sentence, _) in parts.items():
        ours = [key for key in listed[title] if key.variant == shared.get(key.name)]
        named = [
            key.setting if len(defaults[key.name]) > 1 else f"`{key.name}`" for key in ours if key.name not in common
        ]
        line = f"{title}: {sentence}".removesuffix(": ") + (f" Shared: {', '.join(named)}." if named else "")
        yield f"{line}\n"
        own = [key for key in listed[title] if key not in ours]
        yield from (f"- {key.setting} ({key.allowed})" + (f": {key.meaning}" if key.meaning else "") for key in own)
        if own:
            yield ""


def allowed(slot: Slot) -> str:
    """Return the values that a place takes, in fewer words than an error message."""
    item = slot.child([], 0) if slot.is_list else None
    several = item is not None and get_args(slot.annotation)[-1] is Ellipsis
    if several and item is not None and (item.family or item.part(None)):
        return f"list of {allowed(item)}s"
    if slot.is_table:
        inner = get_args(slot.annotation)[1]
        return "mapping" if inner is Any else f"mapping to: {allowed(Slot.of(inner))}"
    if slot.family is not None:
        return f"{slot.family.name} kind"
    if slot.part(None) is not None:
        return "mapping"
    words = slot.words().replace(Slot.of(Name).words(), "name")
    words = words.replace(Slot.of(Switch).words(), "name or NAME.PART")
    for long, short in SHORTER:
        words = re.sub(long, short, f" {words}").strip()
    return words.replace(": a ", ": ")


def default(field: FieldInfo) -> str:
    """Return the default of a field as YAML, "required" or "" for none."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None or (isinstance(value, Part) and not isinstance(value, Kind)):
        return ""
    if isinstance(value, tuple) and value and all(isinstance(item, Kind) for item in value):
        return "[" + ", ".join(f"{{kind: {item.kind}}}" for item in value) + "]"
    return f"{{kind: {value.kind}}}" if isinstance(value, Kind) else json.dumps(plain_value(value))


def cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def first_sentence(part: type) -> str:
    text = " ".join((part.__doc__ or "").split())
    return re.split(r"(?<=\.) ", text)[0]


def scenario_keys() -> Iterator[str]:
    for title, part in OUTER.items():
        yield f"### {title}\n"
        yield from table(keys_of(part))
    yield "### Parts of backgrounds\n"
    yield from group("of these", {title: ("", part) for title, part in INNER.items()})
    for family in FAMILIES:
        yield f"### {family.name} kinds\n"
        yield from group(
            f"{family.name} kinds", {f"`kind: {name}`": (first_sentence(kind), kind) for name, kind in family}
        )


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


PAPER_NAMES = {
    "cheng": "Cheng 2006",
    "xue": "Xue 2011",
    "an": "An 2007",
    "cui": "Cui 2011",
    "camshift": "CamShift and Kalman",
    "li": "Li 2014",
    "cost": "Cost of a step",
    "growth": "Li 2014, growth model",
}


def papers_results() -> dict[str, Any]:
    """Return the results of the papers' page that the documents cite: a copy of its sources.json."""
    found: dict[str, Any] = json.loads((Path(__file__).parent / "papers.json").read_text())
    return found


def papers_claims() -> Iterator[str]:
    found = papers_results()
    first, count = found["seeds"]
    yield f"Commit {found['commit']}, {count} seeds from {first} on; growth model: {found['growth']['runs']} runs."
    yield ""
    yield "| paper | held | not held | no difference | not decidable |"
    yield "| --- | --- | --- | --- | --- |"
    for key, words in (*found["claims"].items(), ("growth", found["growth"]["verdicts"])):
        yield f"| {PAPER_NAMES[key]} | {' | '.join(map(str, words.values()))} |"


def papers_scenes() -> Iterator[str]:
    yield "| scene | tracker | lost | bounded error, px | only runs not lost: mean absolute error in X, Y, px |"
    yield "| --- | --- | --- | --- | --- |"
    shown: tuple[str, ...] = ("grey_pf", "cascade_pf", "mean_shift_pf", "restrained", "mean", "SVD and PF", "PF alone")
    shown += ("fusion_wspf", "standard PF", "optical_flow", "template", "kalman centroid", "camshift_kalman")
    shown += ("coasting_pf", "change_kalman")
    for scene, rows in papers_results()["scenes"].items():
        for label in filter(rows.__contains__, shown):
            row = rows[label]
            kept = ", ".join("–" if each is None else f"{each:.2f}" for each in row["conditional_abs_px"])
            bounded = "–" if row["bounded_px"] is None else f"{row['bounded_px']:.2f}"
            yield f"| {scene} | `{label}` | {row['lost']} of {row['runs']} | {bounded} | {kept} |"


def papers_growth() -> Iterator[str]:
    table = papers_results()["growth"]["rmse_error_neff"]
    yield "| filter, N = 100 | RMSE | Neff |"
    yield "| --- | --- | --- |"
    for label, by_n in table.items():
        rmse, error, neff = by_n["100"]
        yield f"| {label} | {rmse:.2f} ± {error:.2f} | {neff:.1f} |"


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
    yield from group(
        "trackers",
        {
            f"**{name}**": (f"{first_sentence(tracker)} Source: {tracker.source}.", tracker)
            for name, tracker in TRACKERS.items()
        },
    )


def suite_keys() -> Iterator[str]:
    for title, part in SUITE_PARTS.items():
        yield f"### {title}\n"
        yield f"{' '.join((part.__doc__ or '').split())}\n"
        yield from table(keys_of(part))


def property_list() -> Iterator[str]:
    yield "property | what holds"
    yield "--- | ---"
    for each in PROPERTIES.values():
        yield f"`{each.name}` | {cell(each.says)}"


def task_property_list() -> Iterator[str]:
    """Names only: `irtrack check` prints the statements."""
    yield "| of | properties |"
    yield "| --- | --- |"
    for task, whose in (("detect", "detectors"), ("many", "trackers of many")):
        yield f"| {whose} | {', '.join(PROPERTIES_OF[task])} |"  # type: ignore[index]  # a task


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
    yield "name | what it is"
    yield "--- | ---"
    for name in package.__all__:
        value = getattr(package, name)
        text = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split()) if callable(value) else ""
        choices = ", ".join(map(repr, get_args(value)))
        sentence = re.split(r"(?<=\.) (?=[A-Z`])", text)[0] if text else f"One of {choices}."
        yield f"`{package.__name__}.{name}` | {cell(sentence)}"


PARTS: dict[str, Callable[[], Iterator[str]]] = {
    "scenario keys": scenario_keys,
    "examples": example_list,
    "source scenes": source_scenes,
    "papers claims": papers_claims,
    "papers scenes": papers_scenes,
    "papers growth": papers_growth,
    "stresses": stress_list,
    "tracker parameters": tracker_keys,
    "suite keys": suite_keys,
    "properties": property_list,
    "properties of tasks": task_property_list,
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
