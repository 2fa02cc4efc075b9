"""Overrides KEY=VALUE of values in a scenario: `camera.netd_mk=80`, `targets.jet.path.speed=3`."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from irsim.config.base import KeyPath, Part
from irsim.config.diagnostics import allowed_text
from irsim.config.paths import DIGEST, FILE, same_name
from irsim.config.schema import Slot, item_name, item_names
from irsim.config.serialization import brief_value
from irsim.config.yaml_text import Document, dotted, scalar
from irsim.errors import InputError

TABLES = ("severities", "vary")
"""Keys of a scenario that hold tables; the keys in these tables are override keys."""


def expect_overrides(overrides: object) -> list[str]:
    """Return the overrides given by a caller; InputError for anything but a list of texts, such as a mapping."""
    if isinstance(overrides, Mapping):
        raise InputError(
            f"overrides {reprlib.repr(overrides)}: is a mapping; allowed: a list of texts, such as "
            "['camera.netd_mk=80'], or irsim.change(scenario, {'camera.netd_mk': 80})"
        )
    if isinstance(overrides, str):
        raise InputError(f"overrides {overrides!r}: allowed: a list of them, [{overrides!r}]")
    texts: list[Any] = list(overrides) if isinstance(overrides, Iterable) else [None]
    if not all(isinstance(text, str) for text in texts):
        raise InputError(
            f"overrides {reprlib.repr(overrides)}: allowed: a list of texts, such as ['camera.netd_mk=80']"
        )
    return texts


def apply_override(
    document: Document, text: str, root: type[Part], given: Iterable[KeyPath] = ()
) -> tuple[Document, KeyPath]:
    """Return the document with one value set, and its path; errors in the value are placed at 'override KEY'.

    A step of a key selects a list item by its id (by its kind if it has no id) or by its number. A part that the
    document lacks starts from its default. `given` as in `set_value`. InputError where the path leads nowhere.
    """
    key, sign, written = text.partition("=")
    key = key.strip()
    if not sign or not key:
        raise InputError(f"override {text!r}: not KEY=VALUE; allowed: e.g. camera.netd_mk=80")
    place = place_of_override(text)
    try:
        value = scalar(written)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return set_value(document, key, value, place, root, given)


def place_of_override(text: str) -> str:
    """Return 'override KEY', which stands for the position of KEY=VALUE in errors and warnings."""
    return f"override {place_of_key(text.partition('=')[0].strip())}"


def place_of_key(key: str) -> str:
    """Return the key of an override on one line, for errors."""
    return dotted(tuple(key.split(".")))


def set_value(
    document: Document, key: str, value: Any, place: str, root: type[Part], given: Iterable[KeyPath] = ()
) -> tuple[Document, KeyPath]:
    """Return the document with `value` at an override's key, with `place` as its position in errors, and the path of
    the key.

    given   paths of values set by the user; a digest among them is kept when the file beside it is replaced

    Raises InputError, 'place: problem', where the key leads nowhere.
    """
    try:
        tree, path = _set(document.value, Slot.of(root), key.split("."), value, list(given))
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    changed = replace(
        document,
        value=tree,
        values=_outside(document.values, path) | {path: place},
        keys=_outside(document.keys, path) | {path: place},
    )
    return changed, path


def table_entries(document: Document) -> list[tuple[str, str]]:
    """Return the table and the override key of each entry of a scenario's `TABLES`."""
    return [(name, key) for name in TABLES for key in table(document, name)]


def table(document: Document, name: str) -> dict[str, Any]:
    """Return one of a scenario's `TABLES`; empty where it has none."""
    found = document.value.get(name)
    return found if isinstance(found, dict) else {}


def _set(
    node: Any, slot: Slot | None, steps: list[str], value: Any, given: Sequence[KeyPath] = ()
) -> tuple[Any, KeyPath]:
    """Return a copy of `node` with the value at the steps, and their path; paths in `given` begin at `node`."""
    if not steps:
        return value, ()
    if isinstance(node, dict):
        return _set_in_mapping(node, slot, steps, value, given)
    if isinstance(node, list):
        index = _index(node, slot, steps[0])
        child = slot.child(node, index) if slot is not None else None
        item, path = _set(node[index], child, steps[1:], value, _below(given, index))
        return [*node[:index], item, *node[index + 1 :]], (index, *path)
    raise _no_parent(steps[0])


def _set_in_mapping(
    node: dict[str, Any], slot: Slot | None, steps: list[str], value: Any, given: Sequence[KeyPath]
) -> tuple[Any, KeyPath]:
    step, *rest = _table_key(node, steps) if slot is not None and slot.is_table else steps
    part = slot.part(node) if slot is not None else None
    child = slot.child(node, step) if slot is not None else None
    if part is not None and child is None and step != "kind":
        keys = [*(["kind"] if slot is not None and slot.family else []), *part.model_fields]
        raise InputError(f"unknown key {step!r}{allowed_text(keys, step)}")
    below = node.get(step)
    names_another = step == FILE and child is not None and child.is_file and not same_name(value, below)
    if names_another and (DIGEST,) not in given:
        node = {other: item for other, item in node.items() if other != DIGEST}  # the digest of the replaced file
    if below is None and rest:
        below = _default(part, step, child, rest[0], node)
    below, path = _set(below, child, rest, value, _below(given, step))
    return {**node, step: below}, (step, *path)


def _below(paths: Sequence[KeyPath], step: str | int) -> list[KeyPath]:
    """Return the rest of the paths that begin with `step`."""
    return [path[1:] for path in paths if path[:1] == (step,)]


def _table_key(node: dict[str, Any], steps: list[str]) -> list[str]:
    """Return the steps, with the first ones joined to the key of the table that they spell, as such keys contain dots.
    All steps are joined for a new key."""
    lengths = [length for length in range(len(steps), 0, -1) if ".".join(steps[:length]) in node]
    length = lengths[0] if lengths else len(steps)
    return [".".join(steps[:length]), *steps[length:]]


def _default(part: type[Part] | None, step: str, slot: Slot | None, below: str, node: dict[str, Any]) -> Any:
    """Return the default of a key that `node` leaves out, as the base of an override."""
    if part is None or slot is None:
        return {}
    default = brief_value(part.default_for(step, node))
    if isinstance(default, dict | list):
        return default
    if slot.family is None and slot.part(None) is None:
        raise _no_parent(below)
    return {}


def _no_parent(step: str) -> InputError:
    return InputError(f"there is no {step!r} here: the key above it holds a single value")


def _index(items: list[Any], slot: Slot | None, step: str) -> int:
    if step.isascii() and step.isdigit() and int(step) < len(items):
        return int(step)
    names = [item_name(slot.child(items, index) if slot else None, item) for index, item in enumerate(items)]
    if names.count(step) == 1:
        return names.index(step)
    if step in names:
        raise InputError(f"there are {names.count(step)} of '{step}'; allowed: their numbers, from 0")
    known = item_names(slot, items) if slot is not None else [str(index) for index in range(len(items))]
    raise InputError(f"there is no {step!r}{allowed_text(known, step)}")


def _outside(places: Mapping[KeyPath, str], path: KeyPath) -> dict[KeyPath, str]:
    return {here: place for here, place in places.items() if here[: len(path)] != path}
