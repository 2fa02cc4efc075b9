"""A document at one of its severities: the values that it lists under `severities` put where they belong."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from irsim.errors import InputError
from irsim.explain import place_of
from irsim.kinds import Part
from irsim.overrides import placed
from irsim.yamlfile import Document, KeyPath

TABLES = ("severities", "vary")
"""Keys of a scenario under which override keys stand."""

_NO_CAUSES = {"about", "seed", "expect", *TABLES}
"""Keys that make a scene no harder: they cannot stand in a table."""


def settle(document: Document, root: type[Part], given: Iterable[KeyPath]) -> Document:
    """The document with the values of its severity.

    A key that was `given` by hand stays as it was given, and leaves the tables: it varies no more.
    Only what is well formed is applied; what is not, is found when the document is validated.
    InputError, a line for each, where a key of a table leads nowhere.
    """
    wrong: list[str] = []
    fixed = list(given)
    for table in TABLES:
        for key in list(_table(document, table)):
            try:
                # What stands there does not matter here: the path does.
                path = placed(document, key, None, _place(document, table, key), root)[1]
                if path[0] in _NO_CAUSES or (table, path) == ("severities", ("severity",)):
                    raise InputError(f"{_place(document, table, key)}: '{key}' cannot vary")
            except InputError as error:
                wrong.append(str(error))
            else:
                if any(path[: len(other)] == other[: len(path)] for other in fixed):
                    document = _dropped(document, table, key)
    if wrong:
        raise InputError("\n".join(wrong))
    severity = document.value.get("severity", 0)
    for key, values in _table(document, "severities").items():
        if isinstance(values, list) and type(severity) is int and 0 <= severity < len(values):
            place = place_of(document, ("severities", key, severity))
            document, _ = placed(document, key, values[severity], place, root)
    return document


def _table(document: Document, table: str) -> dict[str, Any]:
    found = document.value.get(table)
    return found if isinstance(found, dict) else {}


def _place(document: Document, table: str, key: str) -> str:
    return f"{place_of(document, (table, key), at_key=True)}: {table}"


def _dropped(document: Document, table: str, key: str) -> Document:
    left = {name: item for name, item in _table(document, table).items() if name != key}
    return replace(document, value={**document.value, table: left})
