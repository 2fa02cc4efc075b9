"""Severities of a document: the values under `severities`, copied to the keys for which they stand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from irsim.config.base import KeyPath, Part
from irsim.config.diagnostics import place_of
from irsim.config.overrides import set_value, table, table_entries
from irsim.config.yaml_text import Document, dotted
from irsim.errors import InputError

_NOT_VARIABLE = {"about", "seed", "expect", "severities", "vary"}
"""Keys that make no scene harder, and so are not allowed under `severities` and `vary`."""
_VARIABLE = "keys that change the picture, such as camera.netd_mk"


def apply_severity(document: Document, root: type[Part], given: Iterable[KeyPath]) -> Document:
    """Return the document with the values that `severities` lists for its severity copied to their keys.

    given   key paths set by the user: such a key, or one within it, keeps its value and is removed from the tables
            `severities` and `vary`

    If no key is left under `severities`, all severities are equal and the severity becomes 0. Only valid entries are
    applied. Validation reports the others, and `table_faults` those whose key does not exist.
    """
    fixed, faults = list(given), table_faults(document, root)
    lists = [values for values in table(document, "severities").values() if isinstance(values, list)]
    levels = min(map(len, lists), default=0)
    for name, key in table_entries(document):
        if (name, key) not in faults:
            path = _path(document, name, key, root)
            if any(path[: len(other)] == other[: len(path)] for other in fixed):
                document = _without_entry(document, name, key)
    severity = document.value.get("severity", 0)
    if type(severity) is int and 0 <= severity < levels and not table(document, "severities"):
        document = replace(document, value={**document.value, "severity": 0})
    for key, values in table(document, "severities").items():
        valid = ("severities", key) not in faults and isinstance(values, list)
        if valid and type(severity) is int and 0 <= severity < len(values):
            place = place_of(document, ("severities", key, severity))
            document, _ = set_value(document, key, values[severity], place, root)
    return document


def table_faults(document: Document, root: type[Part]) -> dict[tuple[str, str], str]:
    """Return an error line for each table key that does not exist or cannot vary, by (table, key)."""
    faults = {}
    for name, key in table_entries(document):
        try:
            path = _path(document, name, key, root)
            if path[0] in _NOT_VARIABLE or (name, path) == ("severities", ("severity",)):
                raise InputError(f"{_place(document, name, key)}: '{key}' cannot vary; allowed: {_VARIABLE}")
        except InputError as error:
            faults[name, key] = str(error)
    return faults


def _without_entry(document: Document, name: str, key: str) -> Document:
    left = {other: item for other, item in table(document, name).items() if other != key}
    return replace(document, value={**document.value, name: left})


def _path(document: Document, name: str, key: str, root: type[Part]) -> KeyPath:
    # The path does not depend on the value.
    return set_value(document, key, None, _place(document, name, key), root)[1]


def _place(document: Document, name: str, key: str) -> str:
    """Return the position of a table's key as text: 'file:line:column: vary.camera.netd'."""
    entry = dotted((name, key))
    place = place_of(document, (name, key), at_key=True)
    return place if place == f"override {entry}" else f"{place}: {entry}"
