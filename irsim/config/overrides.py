"""KEY=VALUE over a scenario's tree: `camera.netd_mk=80`, `targets.jet.path.speed=3`."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from irsim.config.base import Part
from irsim.config.diagnostics import listed
from irsim.config.file_digests import DIGEST, FILE, same_name
from irsim.config.schema import Slot, brief, item_name, item_names
from irsim.config.yaml_file import Document, KeyPath, dotted, scalar
from irsim.errors import InputError


def given_overrides(overrides: object) -> list[str]:
    """The overrides that a caller gave; InputError for what is no list of texts, such as one text or a mapping."""
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


def override(
    document: Document, text: str, root: type[Part], given: Iterable[KeyPath] = ()
) -> tuple[Document, KeyPath]:
    """The document with one value set, and where; errors in it will be placed at 'override KEY'. `given` as of
    `placed`.

    Steps reach list items by id (or by kind, where they have no id) or number, and a part that the
    text leaves out begins from its default. InputError where the path leads nowhere.
    """
    key, sign, written = text.partition("=")
    key = key.strip()
    if not sign or not key:
        raise InputError(f"override {text!r}: this is no KEY=VALUE; allowed: e.g. camera.netd_mk=80")
    place = place_of_override(text)
    try:
        value = scalar(written)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return placed(document, key, value, place, root, given)


def place_of_override(text: str) -> str:
    """Where the value of KEY=VALUE stands, as errors and warnings have it: 'override KEY'."""
    return f"override {place_of_key(text.partition('=')[0].strip())}"


def place_of_key(key: str) -> str:
    """The key of an override as errors have it: on one line."""
    return dotted(tuple(key.split(".")))


def placed(
    document: Document, key: str, value: Any, place: str, root: type[Part], given: Iterable[KeyPath] = ()
) -> tuple[Document, KeyPath]:
    """The document with `value` at an override's key, known to stand at `place`; and the path that the key means.

    given   places whose values were given by hand: a digest among them stays when another file is named beside it

    InputError, 'place: what', where the key leads nowhere.
    """
    try:
        tree, path = _placed(document.value, Slot.of(root), key.split("."), value, list(given))
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    changed = replace(
        document,
        value=tree,
        values=_without(document.values, path) | {path: place},
        keys=_without(document.keys, path) | {path: place},
    )
    return changed, path


def _placed(
    node: Any, slot: Slot | None, steps: list[str], value: Any, given: Sequence[KeyPath] = ()
) -> tuple[Any, KeyPath]:
    """A copy of `node` with the value at the steps, and the path that they mean; `given` as of `placed`, from here."""
    if not steps:
        return value, ()
    if isinstance(node, dict):
        return _placed_in_mapping(node, slot, steps, value, given)
    if isinstance(node, list):
        index = _index(node, slot, steps[0])
        child = slot.child(node, index) if slot is not None else None
        item, path = _placed(node[index], child, steps[1:], value, _below(given, index))
        return [*node[:index], item, *node[index + 1 :]], (index, *path)
    raise _single(steps[0])


def _placed_in_mapping(
    node: dict[str, Any], slot: Slot | None, steps: list[str], value: Any, given: Sequence[KeyPath]
) -> tuple[Any, KeyPath]:
    step, *rest = _table_key(node, steps) if slot is not None and slot.is_table else steps
    part = slot.part(node) if slot is not None else None
    child = slot.child(node, step) if slot is not None else None
    if part is not None and child is None and step != "kind":
        keys = [*(["kind"] if slot is not None and slot.family else []), *part.model_fields]
        raise InputError(f"unknown key {step!r}{listed(keys, step)}")
    below = node.get(step)
    names_another = step == FILE and child is not None and child.is_file and not same_name(value, below)
    if names_another and (DIGEST,) not in given:
        node = {other: item for other, item in node.items() if other != DIGEST}  # it was the other file's
    if below is None and rest:
        below = _beginning(part, step, child, rest[0], node)
    below, path = _placed(below, child, rest, value, _below(given, step))
    return {**node, step: below}, (step, *path)


def _below(paths: Sequence[KeyPath], step: str | int) -> list[KeyPath]:
    """Those of the paths that lead by that step, from there on."""
    return [path[1:] for path in paths if path[:1] == (step,)]


def _table_key(node: dict[str, Any], steps: list[str]) -> list[str]:
    """The steps with those of the table's key as one, for such keys have dots in them; all, where it is a new one."""
    lengths = [length for length in range(len(steps), 0, -1) if ".".join(steps[:length]) in node]
    length = lengths[0] if lengths else len(steps)
    return [".".join(steps[:length]), *steps[length:]]


def _beginning(part: type[Part] | None, step: str, slot: Slot | None, below: str, node: dict[str, Any]) -> Any:
    """What a key that the text, `node`, leaves out holds, for an override to change some of it."""
    if part is None or slot is None:
        return {}
    default = brief(part.default_for(step, node))
    if isinstance(default, dict | list):
        return default
    if slot.family is None and slot.part(None) is None:
        raise _single(below)
    return {}


def _single(step: str) -> InputError:
    return InputError(f"there is no {step!r} here: what stands above it is a single value")


def _index(items: list[Any], slot: Slot | None, step: str) -> int:
    if step.isascii() and step.isdigit() and int(step) < len(items):
        return int(step)
    names = [item_name(slot.child(items, index) if slot else None, item) for index, item in enumerate(items)]
    if names.count(step) == 1:
        return names.index(step)
    if step in names:
        raise InputError(f"there are {names.count(step)} of '{step}'; allowed: their numbers, from 0")
    known = item_names(slot, items) if slot is not None else [str(index) for index in range(len(items))]
    raise InputError(f"there is no {step!r}{listed(known, step)}")


def _without(places: Any, path: KeyPath) -> dict[KeyPath, str]:
    return {here: place for here, place in places.items() if here[: len(path)] != path}
