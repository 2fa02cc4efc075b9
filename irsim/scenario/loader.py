"""Loading and writing of scenarios. All errors in a user's text are raised here, with their positions in the file.

Steps: `read_document` (YAML with positions, absolute file names), `apply_overrides`, `validate_scenario`.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Generic

from irsim.config.base import AnyPart, KeyPath, Part, importing_nothing
from irsim.config.diagnostics import error_line, validate_part
from irsim.config.overrides import apply_override, expect_overrides, place_of_key, set_value
from irsim.config.paths import begins_as_recording, is_binary, path_of
from irsim.config.relative_paths import with_absolute_names, with_relative_names
from irsim.config.schema import Slot, path_text
from irsim.config.serialization import as_yaml_value, brief_value, plain_value, whole_numbers
from irsim.config.yaml_text import Document, on_a_line, parse_yaml, read_yaml, write_yaml
from irsim.errors import InputError
from irsim.scenario.catalog import find
from irsim.scenario.model import Scenario, expect_scenario
from irsim.scenario.validation import validate_scenario, values_at

SUITE_KEYS = {"sources", "trackers"}
"""Keys by which a file is recognised as a suite of irtrack."""


def load(path: str | PathLike[str], overrides: Iterable[str] = ()) -> Scenario:
    """Return the scenario in a YAML file, or the shipped one of that name, with KEY=VALUE overrides.

    A shell pipe, `<(command)`, is a file too. Raises InputError with one line for each fault, 'file:line:column: key:
    problem; allowed: ...'.
    """
    return validate_scenario(*apply_overrides(read_document(path, Scenario), overrides))


def loads(text: str, name: str = "<text>", overrides: Iterable[str] = (), trusted: bool = True) -> Scenario:
    """Return the scenario in a YAML text. Errors call the text `name`. Raises InputError as in `load`.

    trusted   False for a text in a recording or a results file: no code is run, so the user's own kinds are known only
              if their modules are already imported
    """
    if not isinstance(text, str):
        raise InputError(f"{name}: a {type(text).__name__} is no text; allowed: the YAML text of a scenario")
    document = parse_yaml(text, name)
    with nullcontext() if trusted else importing_nothing():
        return validate_scenario(*apply_overrides(document, overrides))


def dumps(scenario: Scenario, short: bool = False, folder: str | PathLike[str] | None = None) -> str:
    """Return the scenario as YAML text, from which `loads` returns an equal scenario.

    short    True: omit keys with default values; False: write every key
    folder   folder in which the text is stored; names of other files become relative to it, so that all files can be
             moved together. None: names of files stay absolute
    """
    document = scenario_document(expect_scenario("the text", scenario), brief_value if short else plain_value)
    if folder is not None:
        document = with_relative_names(document, path_of(folder), Scenario)
    return write_yaml(document.value)


def change(scenario: Scenario, values: Mapping[str, Any]) -> Scenario:
    """Return the scenario with other values at override keys, such as {"targets.jet.path.speed": 3.0}.

    Changed keys are removed from `severities` and `vary`. Values are read as in YAML, where `1e3` is an integer too.
    Raises InputError as in `load`, with the position 'KEY=VALUE', and for values that YAML cannot represent.
    """
    document = scenario_document(expect_scenario("a change", scenario))
    given: list[KeyPath] = []
    if not (isinstance(values, Mapping) and all(isinstance(key, str) for key in values)):
        raise InputError(
            f"values {reprlib.repr(values)}: allowed: a mapping of override keys to values, such as "
            "{'camera.netd_mk': 80}"
        )
    for key, value in values.items():
        name = place_of_key(key)
        tree = as_yaml_value(value, name)
        document, path = set_value(document, key, tree, f"{name}={on_a_line(tree)}", Scenario, given)
        given.append(path)
    return validate_scenario(document, given)


def values_of(scenario: Scenario, keys: Iterable[str]) -> dict[str, Any]:
    """Return a scenario's values at override keys, as plain YAML values; None where a key has no value."""
    return values_at(scenario_document(scenario), scenario, keys)


@dataclass(frozen=True)
class LoadedPart(Generic[AnyPart]):
    """Part of a YAML file, with the document from which it was read."""

    part: AnyPart
    document: Document

    def line(self, at: KeyPath, problem: str) -> str:
        """Return 'file:line:column: key: problem' for a fault found later at a key path such as ("trackers", 0)."""
        name = path_text(at, Slot.of(type(self.part)), self.document.value)
        return error_line(self.document, at, name, problem)


def read_part(path: str | PathLike[str], part: type[AnyPart], default_folder: str = "examples") -> LoadedPart[AnyPart]:
    """Return the part in a YAML file, or in the shipped file of that name (see `find`). Raises InputError as in
    `load`."""
    document = read_document(path, part, default_folder)
    document = replace(document, value=whole_numbers(document.value))
    return LoadedPart(validate_part(document, part), document)


def build(part: type[AnyPart], values: Mapping[str, Any], name: str) -> AnyPart:
    """Return a part from plain values by key, such as a tracker from its parameters. `1e3` is an integer too."""
    return validate_part(Document(name, as_yaml_value(values, name), {(): name}, {}), part)


def read_document(path: str | PathLike[str], root: type[Part], default_folder: str = "examples") -> Document:
    """Return the document of a file, or of the shipped file of that name (see `find`), with absolute names of files.
    `root` is the class of the part that the file describes."""
    file = find(path, default_folder)
    if begins_as_recording(file):
        raise InputError(f"{path}: is a recording, not YAML; irsim info describes it")
    if is_binary(file):
        raise InputError(
            f"{path}: is neither a scenario nor a recording, it is not UTF-8 text; "
            "irsim import makes recordings of pictures"
        )
    return with_absolute_names(read_yaml(file), file.parent, root)


def apply_overrides(document: Document, overrides: Iterable[str]) -> tuple[Document, list[KeyPath]]:
    """Return a scenario's document with overrides applied, and their key paths. InputError with all their faults."""
    if not isinstance(document.value, dict):
        keys = ", ".join(Scenario.model_fields)
        raise InputError(f"{document.values[()]}: expected a mapping; allowed: the keys {keys}")
    if document.value.keys() >= SUITE_KEYS:
        raise InputError(
            f"{document.values[()]}: has the keys of a suite, not of a scenario; allowed: irtrack bench SUITE, "
            "or irtrack.load_suite; a suite's file name holds 'suite'"
        )
    faults: list[str] = []
    given: list[KeyPath] = []
    for text in expect_overrides(overrides):
        try:
            document, path = apply_override(document, text, Scenario, given)
            given.append(path)
        except InputError as error:
            faults.append(str(error))
    if faults:
        raise InputError("\n".join(faults))
    # Names in overrides, and in a text without a file, are relative to the working directory.
    document = with_absolute_names(document, Path(), Scenario)
    return replace(document, value=whole_numbers(document.value)), given


def scenario_document(scenario: Scenario, as_value: Callable[[Scenario], Any] = brief_value) -> Document:
    """Return the document of a scenario made in Python. Its errors have the position 'scenario'."""
    return Document("scenario", as_value(scenario), {(): "scenario"}, {})
