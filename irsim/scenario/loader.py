"""From YAML text to a Scenario: every error in what the user wrote is raised here, with its place."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from os import PathLike
from pathlib import Path
from typing import Any, Generic

from irsim.config import yaml_file as yamlfile
from irsim.config.base import Part, importing_nothing
from irsim.config.diagnostics import AnyPart, formed, line, place_of
from irsim.config.files import begins_as_recording, is_binary, is_recording, path_of
from irsim.config.overrides import given_overrides, override, place_of_key, place_of_override, placed
from irsim.config.relative_paths import beside, named_from
from irsim.config.schema import Slot, brief, plain, shown
from irsim.config.tree import as_tree, whole_numbers
from irsim.config.wrong_encoding import is_meant_as_text
from irsim.config.yaml_file import Document, KeyPath, on_a_line, scalar
from irsim.errors import InputError, Notice
from irsim.lint import DOUBTS, doubts, unheeded
from irsim.lint.plausible import implausible
from irsim.scenario.catalog import examples, find, shipped
from irsim.scenario.model import Scenario, expect_scenario
from irsim.scenario.ranges import places_of_parts, range_doubts, values_at
from irsim.scenario.severity import merged, settle
from irsim.scenario.validation import told, validated

__all__ = [
    "Written",
    "build",
    "change",
    "dumps",
    "examples",
    "find",
    "load",
    "loads",
    "reach",
    "read_part",
    "scalar",
    "shipped",
    "unheeded_in",
    "unheeded_overrides",
    "warnings",
]

SUITE_KEYS = {"sources", "trackers"}
"""Top keys by which a suite of irtrack is known where a scenario should be."""


def load(path: str | PathLike[str], overrides: Iterable[str] = ()) -> Scenario:
    """The scenario in a YAML file, or the shipped one of that name, with KEY=VALUE overrides. A pipe that a shell makes
    of `<(command)` is one too.

    InputError: a line for each thing that is wrong, 'file:line:column: key: what; allowed: ...'.
    """
    return _scenario(_read(path, Scenario), overrides)


def loads(text: str, name: str = "<text>", overrides: Iterable[str] = (), trusted: bool = True) -> Scenario:
    """The scenario in a YAML text; errors call the text `name`. InputError as `load`.

    trusted   False for a text that came inside a file (a recording, a results file): it may name a
              user's own kinds only where their modules are imported already, for it must run no code
    """
    if not isinstance(text, str):
        raise InputError(f"{name}: a {type(text).__name__} is no text; allowed: the YAML text of a scenario")
    document = yamlfile.parse(text, name)
    if trusted:
        return _scenario(document, overrides)
    with importing_nothing():
        return _scenario(document, overrides)


def change(scenario: Scenario, values: Mapping[str, Any]) -> Scenario:
    """The scenario with values at override keys, such as {"targets.jet.path.speed": 3.0}.

    A key so given varies no more: it leaves `severities` and `vary`. Values mean what they mean in YAML: `1e3` is a
    whole number too. InputError as `load`, where the place of each fault is 'KEY=VALUE', and for a value that YAML has
    no words for.
    """
    document = _document(expect_scenario("a change", scenario))
    given: list[KeyPath] = []
    if not (isinstance(values, Mapping) and all(isinstance(key, str) for key in values)):
        raise InputError(
            f"values {reprlib.repr(values)}: allowed: a mapping of override keys to values, such as "
            "{'camera.netd_mk': 80}"
        )
    for key, value in values.items():
        name = place_of_key(key)
        tree = as_tree(value, name)
        document, path = placed(document, key, tree, f"{name}={on_a_line(tree)}", Scenario, given)
        given.append(path)
    return validated(document, given)


def reach(scenario: Scenario, keys: Iterable[str]) -> dict[str, Any]:
    """What a scenario holds at override keys, as YAML would have it; None where there is nothing."""
    return values_at(_document(scenario), scenario, keys)


@dataclass(frozen=True)
class Written(Generic[AnyPart]):
    """A part as a YAML file says it, and where."""

    part: AnyPart
    document: Document

    def line(self, at: KeyPath, what: str) -> str:
        """'file:line:column: key: what', for what is found wrong later at a place such as ("trackers", 0)."""
        return line(self.document, at, shown(at, Slot.of(type(self.part)), self.document.value), what)


def read_part(path: str | PathLike[str], part: type[AnyPart], wants: str = "examples") -> Written[AnyPart]:
    """The part that a YAML file says, or a shipped one by its name; InputError as `load`.

    wants   the folder of shipped files whose names are told where there is none of that name
    """
    document = _read(path, part, wants)
    document = replace(document, value=whole_numbers(document.value))
    return Written(formed(document, part), document)


def warnings(
    path: str | PathLike[str], overrides: Iterable[str] = (), progress: Callable[[int, int], None] | None = None
) -> list[str]:
    """Lines 'file:line:column: key: warning: what' on what is legal but may not be meant, at each severity unless an
    override says which; what comes at some only names these, at the place of the first. InputError as `load`.

    progress   called with how many looks, at each severity for each kind of doubt, are done, and of how many
    """
    document, given = _changed(_read(path, Scenario), overrides)
    try:
        noticed = list(merged(_noticed_at_each(document, given, progress)))
    except InputError:
        validated(document, given, at_all_severities=True)  # all that is wrong at once
        raise
    return [_warning(*each) for each in noticed]


def _noticed_at_each(
    document: Document, given: list[KeyPath], progress: Callable[[int, int], None] | None
) -> list[list[tuple[Document, Notice]]]:
    """What may not be meant, severity by severity; each of them is looked at once, for occluders are dear to place."""
    chosen = ("severity",) in given
    scenario = validated(document, given, at_all_severities=chosen)
    levels = min(map(len, scenario.severities.values()), default=0)
    one, done = chosen or not levels, count(1)

    def looked() -> None:
        if progress is not None:
            progress(next(done), len(DOUBTS) * (1 if one else levels))

    if one:
        return [_noticed(document, given, scenario, looked)]
    found = []
    for severity in range(levels):
        other, path_of = placed(document, "severity", severity, f"severity {severity}", Scenario)
        ways = [*given, path_of]
        own = severity == scenario.severity
        found.append(_noticed(other, ways, scenario if own else validated(other, ways), looked))
    return found


def _noticed(
    document: Document, given: list[KeyPath], scenario: Scenario, looked: Callable[[], None]
) -> list[tuple[Document, Notice]]:
    """What may not be meant in the document's scenario, each with the document of which its place is."""
    document = settle(document, Scenario, given)
    unlikely = implausible(Slot.of(Scenario), document.value)
    return [(document, each) for each in (*unlikely, *doubts(scenario, looked), *range_doubts(document, scenario))]


def unheeded_overrides(path: str | PathLike[str], overrides: Iterable[str], without: Sequence[str] = ()) -> list[str]:
    """Those of `warnings` that say of an override that it counts for nothing, where the parts named `without` are
    switched off; and a warning of each override of such a part. InputError as `load`."""
    return _unheeded(_read(path, Scenario), given_overrides(overrides), without)


def unheeded_in(text: str, name: str, overrides: Iterable[str], without: Sequence[str] = ()) -> list[str]:
    """The same of overrides of a scenario's text that came inside a file (see `loads`)."""
    with importing_nothing():
        return _unheeded(yamlfile.parse(text, name), list(overrides), without)


def _unheeded(document: Document, overrides: list[str], without: Sequence[str]) -> list[str]:
    document, keys = _changed(document, overrides)
    scenario = validated(document, keys)
    document = settle(document, Scenario, keys)
    off = scenario.model_copy(update={"without": (*scenario.without, *without)})
    given = {place_of_override(text): text.partition("=")[0].strip() for text in overrides}
    idle = (notice for notice in unheeded(off) if place_of(document, notice.at) in given)
    changed = (placed(document, key, None, place, Scenario)[1] for place, key in given.items())
    places = places_of_parts(scenario, without)
    of_parts = (path for path in changed if any(path[: len(place)] == place for place in places))
    return [
        *(_warning(document, notice) for notice in idle),
        *(_warning(document, Notice(path, "what it changes is switched off")) for path in of_parts),
    ]


def dumps(scenario: Scenario, short: bool = False, folder: str | PathLike[str] | None = None) -> str:
    """The scenario as YAML text; `loads` gives the equal scenario.

    short    without defaults, else with every key
    folder   where a file with that text will lie: files that the scene is read from are named as they are found from
             there, and `load` gives the equal scenario when all are moved together. None: by their whole names
    """
    document = _document(expect_scenario("the text", scenario), brief if short else plain)
    return yamlfile.write((document if folder is None else named_from(document, path_of(folder), Scenario)).value)


def build(part: type[AnyPart], values: Mapping[str, Any], name: str) -> AnyPart:
    """A part from plain values by its keys, such as a tracker from its parameters; `1e3` is a whole number too.

    InputError: a line for each thing that is wrong, 'name: key: what; allowed: ...'.
    """
    return formed(Document(name, as_tree(values, name), {(): name}, {}), part)


def _read(path: str | PathLike[str], root: type[Part], wants: str = "examples") -> Document:
    """The document in a file, or in the shipped one of that name (see `find`), meant to be a `root`; the names of files
    in it as they are found from here."""
    file = find(path, wants)
    if file.is_file() and is_recording(file):
        raise InputError(f"{path}: {_no_yaml(file)}")
    if file.is_file() and is_binary(file) and not is_meant_as_text(file):
        raise InputError(
            f"{path}: is neither a scenario nor a recording, it is not UTF-8 text; "
            "irsim import makes recordings of pictures"
        )
    return beside(yamlfile.read(file), file.parent, root)


def _no_yaml(file: Path) -> str:
    """What a file is that goes for a recording, by its content or by its name alone, where YAML should be."""
    if begins_as_recording(file):
        return "is a recording, no YAML; irsim info tells what is in it"
    allowed = "allowed: YAML text, in a file whose name ends in .yaml"
    if file.stat().st_size == 0:
        return f"is empty, no recording and no YAML; {allowed}"
    return f"has the name of a recording and is none, it does not begin as one; {allowed}"


def _scenario(document: Document, overrides: Iterable[str]) -> Scenario:
    return validated(*_changed(document, overrides))


def _changed(document: Document, overrides: Iterable[str]) -> tuple[Document, list[KeyPath]]:
    """The document with overrides, and where they stand in it."""
    if not isinstance(document.value, dict):
        keys = ", ".join(Scenario.model_fields)
        raise InputError(f"{document.values[()]}: expected a mapping; allowed: the keys {keys}")
    if document.value.keys() >= SUITE_KEYS:
        raise InputError(
            f"{document.values[()]}: has the keys of a suite, not of a scenario; allowed: irtrack bench SUITE, "
            "or irtrack.load_suite; a suite's file name holds 'suite'"
        )
    wrong: list[str] = []
    given: list[KeyPath] = []
    for text in given_overrides(overrides):
        try:
            document, path = override(document, text, Scenario, given)
            given.append(path)
        except InputError as error:
            wrong.append(str(error))
    if wrong:
        raise InputError("\n".join(wrong))
    here = beside(document, Path(), Scenario)  # what overrides name, and a text that came without a file
    return replace(here, value=whole_numbers(here.value)), given


def _document(scenario: Scenario, as_value: Callable[[Scenario], Any] = brief) -> Document:
    """A scenario as if it had been read."""
    return Document("scenario", as_value(scenario), {(): "scenario"}, {})


def _warning(document: Document, notice: Notice) -> str:
    return told(document, notice, f"warning: {notice.what}")
