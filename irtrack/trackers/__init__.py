"""The trackers: one table of names, and `make`, which turns a name and parameters into a tracker.

A new tracker is a module with a frozen `TrackerPart` and a line in `TRACKERS`; the contract tests
run over the table. A tracker from elsewhere is named as ``module:Class``, or by an entry point of
the group ``irtrack.trackers``.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple, cast

from pydantic import ValidationError

from irsim.kinds import Part, suggestion
from irtrack.errors import InputError
from irtrack.trackers.base import TrackerPart
from irtrack.trackers.grey_pf import GreyPF
from irtrack.trackers.kalman import Kalman
from irtrack.trackers.template import Template
from irtrack.types import Tracker

TRACKERS: dict[str, type[TrackerPart]] = {
    "grey_pf": GreyPF,
    "template": Template,
    "kalman": Kalman,
}

ENTRY_POINTS = "irtrack.trackers"


class Row(NamedTuple):
    """A line of `irtrack list`."""

    name: str
    summary: str
    source: str


def make(name: str, parameters: Mapping[str, object] | None = None) -> Tracker:
    """The tracker of a name from the table, an entry point, or ``module:Class``.

    InputError, a line for each thing that is wrong: an unknown name or parameter, a wrong type, a
    value out of range, a module that cannot be imported.
    """
    cls = find(name)
    given = dict(parameters or {})
    if issubclass(cls, Part):
        try:
            return cast(Tracker, cls.model_validate(given))
        except ValidationError as error:
            raise InputError("\n".join(_lines(name, cls, error))) from None
    try:
        return cast(Tracker, cls(**given))
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: {error}") from None


def find(name: str) -> type[Any]:
    """The class of a tracker's name; InputError where there is none."""
    if name in TRACKERS:
        return TRACKERS[name]
    installed = _installed()
    if name in installed:
        return _checked(name, _load(name, installed[name]))
    if ":" in name:
        # As with `python -m`, a module of the current folder counts; it must not shadow others.
        here = os.getcwd()
        if here not in sys.path:
            sys.path.append(here)
        return _checked(name, _load(name, EntryPoint(name, name, ENTRY_POINTS)))
    known = [*TRACKERS, *installed]
    raise InputError(f"unknown tracker '{name}'; allowed: {', '.join(known)} or module:Class{suggestion(name, known)}")


def describe() -> list[Row]:
    """A row for every tracker that can be named, for `irtrack list`."""
    rows = [Row(name, _summary(cls), cls.source) for name, cls in TRACKERS.items()]
    for name, entry in _installed().items():
        try:
            cls = _checked(name, _load(name, entry))
        except InputError as error:
            rows.append(Row(name, str(error), entry.value))
        else:
            rows.append(Row(name, _summary(cls), str(getattr(cls, "source", entry.value))))
    return rows


def _installed() -> dict[str, EntryPoint]:
    """Trackers that installed packages bring along; the table's names stay what they are."""
    return {entry.name: entry for entry in entry_points(group=ENTRY_POINTS) if entry.name not in TRACKERS}


def _load(name: str, entry: EntryPoint) -> object:
    try:
        importlib.invalidate_caches()
        return entry.load()
    except Exception as error:  # a foreign module may raise anything while it is imported
        text = " ".join(str(error).split())
        raise InputError(f"cannot import tracker '{name}': {type(error).__name__}: {text}") from None


def _checked(name: str, found: object) -> type[Any]:
    if not isinstance(found, type):
        raise InputError(f"'{name}' is not a tracker; allowed: a class with init, step and resumable")
    missing = [part for part in ("init", "step", "resumable") if not hasattr(found, part)]
    if missing:
        raise InputError(f"'{name}' is not a tracker: it has no {', '.join(missing)} (see irtrack.types.Tracker)")
    return found


def _summary(cls: type[Any]) -> str:
    return (cls.__doc__ or "").strip().partition("\n")[0]


def _lines(name: str, cls: type[Part], error: ValidationError) -> list[str]:
    """One line for each error: which parameter, what is wrong, what is allowed."""
    lines = []
    for one in error.errors():
        key = ".".join(map(str, one["loc"]))
        if one["type"] == "extra_forbidden":
            allowed = list(cls.model_fields)
            lines.append(f"{name}.{key}: unknown parameter; allowed: {', '.join(allowed)}{suggestion(key, allowed)}")
        elif key:
            lines.append(f"{name}.{key}: {_plain(one['msg'])}, not {one['input']!r}")
        else:
            lines.append(f"{name}: {_plain(one['msg'])}")
    return lines


def _plain(message: str) -> str:
    """Pydantic's wording without its prefixes."""
    for prefix in ("Input should be ", "Value error, "):
        message = message.removeprefix(prefix) if prefix.startswith("Value") else message.replace(prefix, "must be ")
    return message
