"""Error messages: pydantic's errors as lines 'file:line:column: key: problem; allowed: ...; did you mean ...?'."""

from __future__ import annotations

import copy
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any, get_args

from pydantic import ValidationError

from irsim.config.base import AnyPart, KeyPath, Part, suggestion
from irsim.config.paths import NO_FILE
from irsim.config.schema import Slot, member, path_text
from irsim.config.yaml_text import Document, dotted
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
"""Type of pydantic's error -> expected type."""
_RANGES = {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"}
_ID_ERRORS = {"duplicate_id", "unknown_id"}
_OTHER_NAMES = {
    "fps": "rate_hz", "framerate": "rate_hz", "frame_rate": "rate_hz", "resolution": "size", "width": "size",
    "height": "size", "shape": "size", "fov": "ifov_mrad", "pixel_pitch": "pitch_um", "n_frames": "frames",
    "length": "frames", "duration": "frames", "position": "start", "pos": "start", "velocity": "speed",
    "temperature": "temperature_k", "temp": "temperature_k", "contrast": "contrast_k", "snr": "scr",
    "blur": "smear", "exposure": "smear", "shake": "motion", "vibration": "motion", "gain": "agc",
}  # fmt: skip
"""Words for keys in other programs -> the key."""
_LONGEST = 40
"""Largest number of characters of a quoted value."""


def validate_part(document: Document, part: type[AnyPart]) -> AnyPart:
    """Return the part that a document describes; InputError with a line for each fault."""
    try:
        return part.model_validate(document.value)
    except ValidationError as error:
        lines = error_lines(error, document, part)
        known = _without_unknown_keys(error, document, part)
    if known != document.value:
        try:
            part.model_validate(known)
        except ValidationError as error:
            lines += error_lines(error, document, part, _ID_ERRORS)
    raise InputError("\n".join(by_place(lines)))


def error_lines(
    error: ValidationError, document: Document, root: type[Part], kinds: Container[str] | None = None
) -> list[str]:
    """Return a line for each fault of a document that describes a `root`, or only for faults of the types `kinds`."""
    top = Slot.of(root)
    lines: dict[tuple[KeyPath, str], str] = {}
    names: dict[KeyPath, list[str]] = {}
    for raw, detail in _flattened(error.errors(include_url=False), ()):
        if kinds is not None and detail["type"] not in kinds:
            continue
        if detail["type"] == "duplicate_id":
            raw, detail = _duplicate(raw, detail, top, document.value)
        path, slot = _resolve(raw, top, document.value)
        kind = detail["type"]
        if kind == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"]:
            continue  # pydantic counts valid items only, and reports invalid ones on their own
        if kind == "missing" and path and isinstance(path[-1], int):
            # Too few items: the fault is the list's, not the missing item's.
            path, slot, kind = path[:-1], _resolve(path[:-1], top, document.value)[1], "too_few"
        # Each alternative of a union has an error: one line is enough.
        once = "" if slot is not None and len(slot.choices) > 1 else f"{kind} {detail['msg']}"
        if (path, once) not in lines:
            problem = " ".join(_problem(kind, detail, slot, path, top, document.value).split())
            name = path_text(path, top, document.value, names)
            if kind == NO_FILE:
                problem += "; allowed: an existing file"
                if path in document.values and not place_of(document, path).startswith("override "):
                    problem += f"; {name}=PATH selects another file"
            lines[path, once] = error_line(document, path, name, problem, kind == "extra_forbidden")
    return by_place(lines.values())


def error_line(document: Document, path: KeyPath, name: str, problem: str, at_key: bool = False) -> str:
    """Return 'file:line:column: key: problem', with the position of the path or of its nearest parent in the
    document."""
    place = place_of(document, path, at_key)
    return f"{place}: {problem}" if not name or place == f"override {name}" else f"{place}: {name}: {problem}"


def place_of(document: Document, path: KeyPath, at_key: bool = False) -> str:
    """Return 'file:line:column' of a value or its key, or of its nearest parent in the document."""
    if at_key and path in document.keys:
        return document.keys[path]
    above = (path[:length] for length in range(len(path), -1, -1))
    return next((document.values[place] for place in above if place in document.values), document.name)


def by_place(lines: Iterable[str]) -> list[str]:
    """Return lines in the order of their positions in the file, lines without a position first."""

    def place(text: str) -> tuple[int, int]:
        found = re.search(r":(\d+):(\d+): ", text)
        return (int(found[1]), int(found[2])) if found else (0, 0)

    return sorted(lines, key=place)


def allowed_text(words: Iterable[str], wrong: str | None = None) -> str:
    """Return "; allowed: a, b; did you mean 'a'?"."""
    known = list(words)
    meant = {other: key for other, key in _OTHER_NAMES.items() if key in known}
    return f"; allowed: {', '.join(known) or 'nothing'}" + ("" if wrong is None else suggestion(wrong, known, meant))


def value_text(given: Any) -> str:
    """Return a short text of a value, close to the user's own."""
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


def _without_unknown_keys(error: ValidationError, document: Document, root: type[Part]) -> Any:
    """Return the document's values without unknown keys, as ids are validated only when all keys are known. An unknown
    key whose value contains text is kept, as the text may be an id that other keys refer to."""
    value = copy.deepcopy(document.value)
    for raw, detail in _flattened(error.errors(include_url=False), ()):
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


def _flattened(errors: Iterable[Mapping[str, Any]], prefix: KeyPath) -> Iterator[tuple[KeyPath, Mapping[str, Any]]]:
    """Yield each error with its whole key path, also errors inside kinds (see `Family`)."""
    for detail in errors:
        context = detail.get("ctx", {})
        path = (*prefix, *detail["loc"])
        if detail["type"] == "inside":
            yield from _flattened(context["errors"], path)
        else:
            yield (*path, *context.get("at", ())), detail


def _duplicate(second: KeyPath, detail: Mapping[str, Any], root: Slot, value: Any) -> tuple[KeyPath, Mapping[str, Any]]:
    """Return the key path at which the user wrote a repeated id, and the error that names the other part with this id.

    Parts of a preset or a default have ids too, but no position in the document.
    """
    context = detail["ctx"]
    first = (*second[: len(second) - len(context["at"])], *context["first"])
    place, other = (second, first) if _is_written(second, value) else (first, second)
    named = other[:-1] if other[-1] == "id" else other
    owner = path_text(named, root, value)
    if not _is_written(other, value):
        preset = member(member(value, other[0]), "preset")
        owner = f"{dotted(named[:2])} of " + (f"the preset '{preset}'" if preset else "the defaults")
    return place, {**detail, "msg": f"the id '{context['name']}' is used twice, also by {owner}; allowed: each id once"}


def _is_written(place: KeyPath, value: Any) -> bool:
    """Return True if the document contains the part with this id, even where the id itself is a default."""
    for step in place[:-1] if place[-1] == "id" else place:
        value = member(value, step)
    return value is not None


def _resolve(raw: KeyPath, root: Slot, value: Any) -> tuple[KeyPath, Slot | None]:
    """Return the path in the document, and its slot, for pydantic's path `raw`, which also names alternatives of
    unions."""
    path: KeyPath = ()
    slot: Slot | None = root
    for step in raw:
        if slot is not None and len(slot.choices) > 1 and member(value, step) is None:
            continue
        slot = slot.child(value, step) if slot is not None else None
        value = member(value, step)
        path = (*path, step)
    return path, slot


def _problem(kind: str, detail: Mapping[str, Any], slot: Slot | None, path: KeyPath, root: Slot, value: Any) -> str:
    given = detail.get("input")
    if kind == "extra_forbidden":
        return _unknown_key(path, root, value)
    allowed = f"; allowed: {slot.words()}" if slot is not None and slot.words() else ""
    if kind == "missing":
        return f"it is missing{allowed}"
    if slot is not None and len(slot.choices) > 1 and "at" not in detail.get("ctx", {}):
        words = [word for choice in slot.choices for word in get_args(choice.annotation) if isinstance(word, str)]
        seen = f"a list of {len(given)}" if isinstance(given, list) else value_text(given)
        return f"{seen} is not allowed{allowed}{suggestion(given, words)}"
    if kind in _EXPECTED:
        return f"expected {_EXPECTED[kind]}, not {value_text(given)}{allowed}"
    if kind.startswith("string_"):
        return f"{value_text(given)} is not allowed{allowed}"
    if kind in _RANGES or kind == "int_parsing_size":
        return f"{value_text(given)} is out of range{allowed}"
    if kind == "literal_error" and slot is not None:
        return f"unknown value {value_text(given)}{allowed}{suggestion(given, map(str, get_args(slot.annotation)))}"
    if kind in ("too_long", "too_short", "too_few"):
        many = "few" if kind != "too_long" else "many"
        return f"too {many} items{allowed}"
    return str(detail["msg"]).removeprefix("Value error, ")


def _unknown_key(path: KeyPath, root: Slot, value: Any) -> str:
    slot, part = _parent(path, root, value)
    if slot is None:
        return "unknown key"
    keys = list(part.model_fields) if part is not None else []
    words, wrong = (["kind", *keys] if slot.family else keys), str(path[-1])
    return f"unknown key{allowed_text(words, wrong)}"


def _parent(path: KeyPath, root: Slot, value: Any) -> tuple[Slot | None, type[Part] | None]:
    """Return the parent slot of a path and the class of the part in it; None where unknown."""
    slot = root
    for step in path[:-1]:
        child = slot.child(value, step)
        if child is None:
            return None, None
        slot, value = child, member(value, step)
    return slot, slot.part(value)
