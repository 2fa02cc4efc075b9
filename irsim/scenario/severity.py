"""A document at one of its severities: the values that it lists under `severities` put where they belong."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from irsim.config.base import Part
from irsim.config.diagnostics import place_of
from irsim.config.overrides import placed
from irsim.config.yaml_file import Document, KeyPath, dotted
from irsim.errors import InputError, Notice

TABLES = ("severities", "vary")
"""Keys of a scenario under which override keys stand."""

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
"""A number in a sentence; those in names, such as jet2, are none."""

_NO_CAUSES = {"about", "seed", "expect", *TABLES}
"""Keys that make a scene no harder: they cannot stand in a table."""
_CAUSES = "keys that change what is seen, such as camera.netd_mk"


def settle(document: Document, root: type[Part], given: Iterable[KeyPath]) -> Document:
    """The document with the values of its severity.

    A key that was `given` by hand, or within what was, stays as it was given, and leaves the tables: it varies no more.
    Where no key is left under `severities`, all severities are the same, and it is at severity 0.
    Only what is well formed is applied; what is not, is found when the document is validated, and of keys that lead
    nowhere by `astray`.
    """
    fixed, lost = list(given), astray(document, root)
    levels = _levels(document)
    for table, key in entries(document):
        if (table, key) not in lost:
            path = _path(document, table, key, root)
            if any(path[: len(other)] == other[: len(path)] for other in fixed):
                document = without(document, table, key)
    severity = document.value.get("severity", 0)
    if type(severity) is int and 0 <= severity < levels and not _table(document, "severities"):
        document = replace(document, value={**document.value, "severity": 0})
    for key, values in _table(document, "severities").items():
        known = ("severities", key) not in lost and isinstance(values, list)
        if known and type(severity) is int and 0 <= severity < len(values):
            place = place_of(document, ("severities", key, severity))
            document, _ = placed(document, key, values[severity], place, root)
    return document


def astray(document: Document, root: type[Part]) -> dict[tuple[str, str], str]:
    """What is wrong with each key of a table, by table and key, that leads nowhere or to what cannot vary."""
    wrong = {}
    for table, key in entries(document):
        try:
            path = _path(document, table, key, root)
            if path[0] in _NO_CAUSES or (table, path) == ("severities", ("severity",)):
                raise InputError(f"{_place(document, table, key)}: '{key}' cannot vary; allowed: {_CAUSES}")
        except InputError as error:
            wrong[table, key] = str(error)
    return wrong


def at_severities(severities: Sequence[int]) -> str:
    """'at severity 2', 'at severities 2, 3 and 5', 'at severities 1 to 4'."""
    *others, last = map(str, severities)
    if len(others) > 1 and severities[-1] - severities[0] == len(others):
        return f"at severities {others[0]} to {last}"
    return f"at severities {', '.join(others)} and {last}" if others else f"at severity {last}"


def merged(found: Sequence[Iterable[tuple[Document, Notice]]]) -> Iterator[tuple[Document, Notice]]:
    """What is noticed at each severity, the first of it standing for those that differ in numbers alone; what comes at
    some severities only names them, and where numbers differ, they are those of the first."""
    same: dict[tuple[object, ...], list[tuple[int, Document, Notice]]] = {}
    for severity, noticed in enumerate(found):
        times: Counter[tuple[object, ...]] = Counter()
        for document, notice in noticed:
            key = (notice.at, _NUMBER.sub("#", notice.what))
            times[key] += 1
            same.setdefault((*key, times[key]), []).append((severity, document, notice))
    for each in same.values():
        (_, document, notice), at = each[0], [severity for severity, _, _ in each]
        alike = all(other.what == notice.what for _, _, other in each)
        where = "" if alike and len(at) == len(found) else f"{at_severities(at)}: "
        yield document, notice._replace(what=f"{where}{'' if alike else 'at the first of them: '}{notice.what}")


def entries(document: Document) -> list[tuple[str, str]]:
    """Table and key of all that stands in the tables."""
    return [(table, key) for table in TABLES for key in _table(document, table)]


def without(document: Document, table: str, key: str) -> Document:
    """The document less one key of a table."""
    left = {name: item for name, item in _table(document, table).items() if name != key}
    return replace(document, value={**document.value, table: left})


def _levels(document: Document) -> int:
    """How many severities there are; 0 where none are listed."""
    return min(
        (len(values) for values in _table(document, "severities").values() if isinstance(values, list)), default=0
    )


def _path(document: Document, table: str, key: str, root: type[Part]) -> KeyPath:
    # What stands there does not matter here: the path does.
    return placed(document, key, None, _place(document, table, key), root)[1]


def _table(document: Document, table: str) -> dict[str, Any]:
    found = document.value.get(table)
    return found if isinstance(found, dict) else {}


def _place(document: Document, table: str, key: str) -> str:
    """'file:line:column: vary.camera.netd'."""
    name = dotted((table, key))
    place = place_of(document, (table, key), at_key=True)
    return place if place == f"override {name}" else f"{place}: {name}"
