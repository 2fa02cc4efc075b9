"""From YAML text to a Scenario: every error in what the user wrote is raised here, with its place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from irsim import yamlfile
from irsim.errors import InputError, Notice
from irsim.explain import explain, line, listed
from irsim.intent import idle, unmet
from irsim.kinds import Part, importing_nothing
from irsim.overrides import override
from irsim.scenario import Scenario
from irsim.schema import Slot, plain, shown
from irsim.yamlfile import Document, scalar

__all__ = ["build", "dumps", "examples", "find", "load", "loads", "scalar", "shipped", "warnings"]

_LARGEST_WHOLE = 2**53
"""Up to here a float that is a whole number says exactly which."""


AnyPart = TypeVar("AnyPart", bound=Part)


def load(path: str | PathLike[str], overrides: Iterable[str] = ()) -> Scenario:
    """The scenario in a YAML file, or the shipped one of that name, with KEY=VALUE overrides.

    InputError: a line for each thing that is wrong, 'file:line:column: key: what; allowed: ...'.
    """
    return _scenario(yamlfile.read(find(path)), overrides)


def loads(text: str, name: str = "<text>", overrides: Iterable[str] = (), trusted: bool = True) -> Scenario:
    """The scenario in a YAML text; errors call the text `name`. InputError as `load`.

    trusted   False for a text that came inside a file (a recording, a results file): it may name a
              user's own kinds only where their modules are imported already, for it must run no code
    """
    document = yamlfile.parse(text, name)
    if trusted:
        return _scenario(document, overrides)
    with importing_nothing():
        return _scenario(document, overrides)


def warnings(path: str | PathLike[str], overrides: Iterable[str] = ()) -> list[str]:
    """Lines 'file:line:column: key: warning: what' on what is legal but may not be meant. InputError as `load`."""
    document = _changed(yamlfile.read(find(path)), overrides)
    scenario = _validated(document)
    doubts = [*scenario.warnings(), *idle(scenario)]
    return [_told(document, notice, f"warning: {notice.what}") for notice in doubts]


def dumps(scenario: Scenario) -> str:
    """The scenario as YAML text with every key written out; `loads` gives the equal scenario."""
    return yamlfile.write(plain(scenario))


def examples() -> dict[str, Path]:
    """The scenarios that are shipped as examples, by name."""
    return shipped("examples")


def shipped(folder: str) -> dict[str, Path]:
    """The scenarios that are shipped with irsim in a folder (examples, sources, stress), by name."""
    here = Path(__file__).parent
    places = [here.parent / "scenarios" / folder, here / "scenarios" / folder]
    return {path.stem: path for place in places for path in sorted(place.glob("*.yaml"))}


def find(path: str | PathLike[str]) -> Path:
    """The file of that path, else the shipped scenario of that name: `sky`, or `sources/xue-sky` with its folder."""
    wanted = fspath(path)
    try:
        exists = Path(path).exists()
    except (OSError, ValueError):
        exists = False
    folder, slash, name = wanted.rpartition("/")
    if exists or Path(name).suffix or Path(name).name != name or Path(folder).name != folder:
        return Path(path)
    names = {f"{folder}{slash}{known}": file for known, file in shipped(folder or "examples").items()}
    if wanted in names:
        return names[wanted]
    if folder and not names:
        return Path(path)
    raise InputError(
        f"{wanted}: there is no such file and no shipped scenario of that name{listed(sorted(names), wanted)}"
    )


def build(part: type[AnyPart], values: Mapping[str, Any], name: str) -> AnyPart:
    """A part from plain values by its keys, such as a tracker from its parameters; `1e3` is a whole number too.

    InputError: a line for each thing that is wrong, 'name: key: what; allowed: ...'.
    """
    document = Document(name, _whole(dict(values)), {(): name}, {})
    try:
        return part.model_validate(document.value)
    except ValidationError as error:
        raise InputError("\n".join(explain(error, document, part))) from None


def _scenario(document: Document, overrides: Iterable[str]) -> Scenario:
    return _validated(_changed(document, overrides))


def _changed(document: Document, overrides: Iterable[str]) -> Document:
    """The document with overrides."""
    if not isinstance(document.value, dict):
        keys = ", ".join(Scenario.model_fields)
        raise InputError(f"{document.values[()]}: expected a mapping; allowed: the keys {keys}")
    wrong = []
    for text in overrides:
        try:
            document = override(document, text, Scenario)
        except InputError as error:
            wrong.append(str(error))
    if wrong:
        raise InputError("\n".join(wrong))
    return replace(document, value=_whole(document.value))


def _validated(document: Document) -> Scenario:
    try:
        scenario = Scenario.model_validate(document.value)
    except ValidationError as error:
        raise InputError("\n".join(explain(error, document, Scenario))) from None
    faults = [_told(document, notice, notice.what) for notice in unmet(scenario)]
    if faults:
        raise InputError("\n".join(faults))
    return scenario


def _told(document: Document, notice: Notice, what: str) -> str:
    """'file:line:column: key: what'."""
    return line(document, notice.at, shown(notice.at, Slot.of(Scenario), document.value), what)


def _whole(value: Any) -> Any:
    """The same tree with `1e3` as 1000: parts tell whole numbers from others, YAML's spelling must not."""
    if isinstance(value, dict):
        return {key: _whole(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_whole(item) for item in value]
    if isinstance(value, float) and value.is_integer() and abs(value) < _LARGEST_WHOLE:
        return value if value == 0 and math.copysign(1, value) < 0 else int(value)
    return value
