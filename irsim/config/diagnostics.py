"""pydantic's errors as lines that say the place, the key, what is wrong and what is allowed."""

from __future__ import annotations

import copy
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from irsim.config.base import Part, suggestion
from irsim.config.file_digests import NO_FILE
from irsim.config.schema import Slot, member, shown
from irsim.config.yaml_file import Document, KeyPath, dotted
from irsim.errors import InputError

_EXPECTED = {
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "string_type": "text",
    "tuple_type": "a list",
    "model_type": "a mapping",
    "dict_type": "a mapping",
    "mapping_type": "a mapping",
}
_RANGES = {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"}
_OF_IDS = {"duplicate_id", "unknown_id"}
_LONGEST = 40
_HEADING = "heading_deg"


AnyPart = TypeVar("AnyPart", bound=Part)


def formed(document: Document, part: type[AnyPart]) -> AnyPart:
    """The part that a document says; InputError, a line for each thing that is wrong."""
    try:
        return part.model_validate(document.value)
    except ValidationError as error:
        lines = explain(error, document, part)
        known = _known(error, document, part)
    if known != document.value:
        try:
            part.model_validate(known)
        except ValidationError as error:
            lines += explain(error, document, part, _OF_IDS)
    raise InputError("\n".join(in_order(lines)))


def explain(
    error: ValidationError, document: Document, root: type[Part], kinds: Container[str] | None = None
) -> list[str]:
    """A line for each thing (of those kinds) that is wrong with a document that was meant to be a `root`."""
    top = Slot.of(root)
    lines: dict[tuple[KeyPath, str], str] = {}
    for raw, detail in _flat(error.errors(include_url=False), ()):
        if kinds is not None and detail["type"] not in kinds:
            continue
        if detail["type"] == "duplicate_id":
            raw, detail = _twice(raw, detail, top, document.value)
        path, slot = _resolve(raw, top, document.value)
        kind = detail["type"]
        if kind == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"]:
            continue  # pydantic counts the items that are right; those that are wrong are told by lines of their own
        if kind == "missing" and path and isinstance(path[-1], int):
            # Too few items: the list is what is wrong, not an item that is not there.
            path, slot, kind = path[:-1], _resolve(path[:-1], top, document.value)[1], "too_few"
        # The alternatives of a union each complain: one line says it.
        once = "" if slot is not None and len(slot.choices) > 1 else f"{kind} {detail['msg']}"
        if (path, once) not in lines:
            what = " ".join(_what(kind, detail, slot, path, top, document.value).split())
            name = shown(path, top, document.value)
            if kind == NO_FILE:
                what += "; allowed: a file that is there"
                if path in document.values and not place_of(document, path).startswith("override "):
                    what += f"; {name}=PATH puts another in its place"
            lines[path, once] = line(document, path, name, what, kind == "extra_forbidden")
    return in_order(lines.values())


def line(document: Document, path: KeyPath, name: str, what: str, at_key: bool = False) -> str:
    """'file:line:column: key: what', at the nearest place that the document has for the path."""
    place = place_of(document, path, at_key)
    return f"{place}: {what}" if not name or place == f"override {name}" else f"{place}: {name}: {what}"


def place_of(document: Document, path: KeyPath, at_key: bool = False) -> str:
    """'file:line:column' of a value or its key, or of the nearest above it that the document has."""
    if at_key and path in document.keys:
        return document.keys[path]
    above = (path[:length] for length in range(len(path), -1, -1))
    return next((document.values[place] for place in above if place in document.values), document.name)


def _known(error: ValidationError, document: Document, root: type[Part]) -> Any:
    """The document's values without unknown keys: ids are looked at when all keys are known. Not without what may
    have, or be, an id to which others refer: text."""
    value = copy.deepcopy(document.value)
    for raw, detail in _flat(error.errors(include_url=False), ()):
        path, _ = _resolve(raw, Slot.of(root), document.value)
        if detail["type"] == "extra_forbidden" and not _has_text(detail["input"]):
            above = value
            for step in path[:-1]:
                above = member(above, step)
            above.pop(path[-1], None)
    return value


def _has_text(value: Any) -> bool:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return isinstance(value, str) or any(map(_has_text, inner))


def in_order(lines: Iterable[str]) -> list[str]:
    """Lines by their places in the file."""
    return sorted(lines, key=_order)


def _order(text: str) -> tuple[int, int]:
    """Line and column in the file; what has none comes first, as it came."""
    found = re.search(r":(\d+):(\d+): ", text)
    return (int(found[1]), int(found[2])) if found else (0, 0)


def listed(words: Iterable[str], wrong: str | None = None) -> str:
    """'; allowed: a, b; did you mean 'a'?'."""
    known = list(words)
    return f"; allowed: {', '.join(known) or 'nothing'}" + ("" if wrong is None else suggestion(wrong, known))


def _flat(errors: Iterable[Mapping[str, Any]], prefix: KeyPath) -> Iterator[tuple[KeyPath, Mapping[str, Any]]]:
    for detail in errors:
        context = detail.get("ctx", {})
        path = (*prefix, *detail["loc"])
        if detail["type"] == "inside":
            yield from _flat(context["errors"], path)
        else:
            yield (*path, *context.get("at", ())), detail


def _twice(second: KeyPath, detail: Mapping[str, Any], root: Slot, value: Any) -> tuple[KeyPath, Mapping[str, Any]]:
    """Where the user wrote an id that is used twice, and the error that says who else has it.

    What a preset or a default brings has names too, and no place in the document.
    """
    context = detail["ctx"]
    first = (*second[: len(second) - len(context["at"])], *context["first"])
    place, other = (second, first) if _is_written(second, value) else (first, second)
    named = other[:-1] if other[-1] == "id" else other
    owner = shown(named, root, value)
    if not _is_written(other, value):
        preset = member(member(value, other[0]), "preset")
        owner = f"{dotted(named[:2])} of " + (f"the preset '{preset}'" if preset else "the defaults")
    return place, {**detail, "msg": f"the id '{context['name']}' is used twice, also by {owner}; allowed: each id once"}


def _is_written(place: KeyPath, value: Any) -> bool:
    """Whether the document has the part whose id is meant; the id itself may be left to its default."""
    for step in place[:-1] if place[-1] == "id" else place:
        value = member(value, step)
    return value is not None


def _resolve(raw: KeyPath, root: Slot, value: Any) -> tuple[KeyPath, Slot | None]:
    """The path in the document and its slot; pydantic also writes a union's alternatives into its path."""
    path: KeyPath = ()
    slot: Slot | None = root
    for step in raw:
        if slot is not None and len(slot.choices) > 1 and member(value, step) is None:
            continue
        slot = slot.child(value, step) if slot is not None else None
        value = member(value, step)
        path = (*path, step)
    return path, slot


def _what(kind: str, detail: Mapping[str, Any], slot: Slot | None, path: KeyPath, root: Slot, value: Any) -> str:
    given = detail.get("input")
    if kind == "extra_forbidden":
        return _unknown_key(path, root, value)
    allowed = f"; allowed: {slot.words()}" if slot is not None and slot.words() else ""
    if kind == "missing":
        return f"it is missing{allowed}"
    if slot is not None and len(slot.choices) > 1 and "at" not in detail.get("ctx", {}):
        words = [word for choice in slot.choices for word in get_args(choice.annotation) if isinstance(word, str)]
        seen = f"a list of {len(given)}" if isinstance(given, list) else _seen(given)
        return f"{seen} is not allowed{allowed}{suggestion(given, words)}"
    if kind in _EXPECTED:
        return f"expected {_EXPECTED[kind]}, not {_seen(given)}{allowed}"
    if kind.startswith("string_"):
        return f"{_seen(given)} is not allowed{allowed}"
    if kind in _RANGES or kind == "int_parsing_size":
        return f"{_seen(given)} is out of range{allowed}{_direction(path, given, root, value)}"
    if kind == "literal_error" and slot is not None:
        return f"unknown value {_seen(given)}{allowed}{suggestion(given, map(str, get_args(slot.annotation)))}"
    if kind in ("too_long", "too_short", "too_few"):
        many = "few" if kind != "too_long" else "many"
        return f"too {many} items{allowed}"
    return str(detail["msg"]).removeprefix("Value error, ")


def _unknown_key(path: KeyPath, root: Slot, value: Any) -> str:
    slot, part = _holder(path, root, value)
    if slot is None:
        return "unknown key"
    keys = list(part.model_fields) if part is not None else []
    return "unknown key" + listed((["kind", *keys] if slot.family else keys), str(path[-1]))


def _direction(path: KeyPath, given: Any, root: Slot, value: Any) -> str:
    """Of a speed below 0, what says instead which way a thing goes."""
    _, part = _holder(path, root, value)
    turned = part is not None and _HEADING in part.model_fields and str(path[-1]).startswith("speed")
    return f"; {_HEADING} says which way it goes" if turned and isinstance(given, int | float) and given < 0 else ""


def _holder(path: KeyPath, root: Slot, value: Any) -> tuple[Slot | None, type[Part] | None]:
    """The slot in which what has the last step of the path stands, and the part that it is, None where unknown."""
    slot = root
    for step in path[:-1]:
        child = slot.child(value, step)
        if child is None:
            return None, None
        slot, value = child, member(value, step)
    return slot, slot.part(value)


def _seen(given: Any) -> str:
    """A value as the user wrote it, about."""
    if given is None:
        return "nothing"
    if isinstance(given, bool):
        return str(given).lower()
    if isinstance(given, dict):
        return "a mapping"
    if isinstance(given, list | tuple):
        return "a list"
    text = repr(given)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "..."
