"""Hypothesis strategies for damage: wrong scenario texts and damaged recordings, to be refused with an InputError."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import Any

from hypothesis import strategies as st

from irsim.config.yaml_text import write_yaml
from irsim.strategies.documents import documents

Place = tuple[str | int, ...]


@st.composite
def invalid_texts(draw: st.DrawFn) -> tuple[str, str]:
    """Draw (fault, an invalid scenario text)."""
    fault = draw(st.sampled_from(list(_FAULTS)))
    return fault, _FAULTS[fault](draw, draw(documents()))


@st.composite
def mutated_texts(draw: st.DrawFn) -> str:
    """Draw a scenario's text with a few pieces cut, moved or inserted; it may still be a scenario."""
    text = write_yaml(draw(documents()))
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        stop = min(start + draw(st.integers(0, 12)), len(text))
        piece = draw(st.one_of(st.text(max_size=6), st.sampled_from(_PIECES), st.just(text[start:stop] * 2)))
        text = text[:start] + piece + text[stop:]
    return text


_PIECES = [
    "\t",
    "\n",
    ": ",
    "- ",
    "{",
    "]",
    "&a ",
    "*a",
    "!!python/name:os.system ",
    "|",
    "'",
    '"',
    "---\n",
    "\x00",
    "<<: ",
]
"""Pieces with a meaning in YAML."""


def _places(value: Any, place: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Yield the path and the value of every node of a tree, the root first."""
    yield place, value
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for step, item in items:
        yield from _places(item, (*place, step))


def _choose(draw: st.DrawFn, tree: Any, wanted: Callable[[Any], bool]) -> Place:
    return draw(st.sampled_from([place for place, value in _places(tree) if wanted(value)]))


def _with(tree: Any, place: Place, value: Any) -> Any:
    """Return a copy of the tree with `value` at the key path `place`."""
    if not place:
        return value
    changed = copy.deepcopy(tree)
    inner = changed
    for step in place[:-1]:
        inner = inner[step]
    inner[place[-1]] = value
    return changed


def _at(tree: Any, place: Place) -> Any:
    for step in place:
        tree = tree[step]
    return tree


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _unknown_key(draw: st.DrawFn, tree: Any) -> str:
    place = _choose(draw, tree, lambda value: isinstance(value, dict))
    return write_yaml(_with(tree, place, {**_at(tree, place), draw(st.sampled_from(_STRANGE_KEYS)): 1}))


_STRANGE_KEYS = ("nosuchkey", "Seed", "", " ", "0", "framess", "__class__", "ключ")


def _unusable_number(draw: st.DrawFn, tree: Any) -> str:
    place = _choose(draw, tree, _is_number)
    bad = draw(st.sampled_from([1e30, -1e30, float("inf"), float("nan"), 10**400]))
    return write_yaml(_with(tree, place, bad))


def _wrong_type(draw: st.DrawFn, tree: Any) -> str:
    place = _choose(draw, tree, lambda value: _is_number(value) or isinstance(value, dict))
    return write_yaml(_with(tree, place, draw(st.sampled_from(["many", "12 px", True, ["a"], "2026-01-01"]))))


def _unknown_kind(draw: st.DrawFn, tree: Any) -> str:
    place = _choose(draw, tree, lambda value: isinstance(value, dict) and "kind" in value)
    words: list[Any] = ["nosuch", "", "Sky", "os:system", "no.such:Kind", "irsim.types:Box", 3, None, []]
    return write_yaml(_with(tree, (*place, "kind"), draw(st.sampled_from(words))))


def _missing_key(draw: st.DrawFn, tree: Any) -> str:
    place = _choose(draw, tree, lambda value: isinstance(value, dict) and bool(value.keys() & {"kind", "shape"}))
    part = _at(tree, place)
    return write_yaml(_with(tree, place, {key: value for key, value in part.items() if key not in ("kind", "shape")}))


def _unknown_id(draw: st.DrawFn, tree: Any) -> str:
    return write_yaml({**tree, "follow": draw(st.sampled_from(["nobody", "targets", "Target", "target "]))})


def _repeated_id(draw: st.DrawFn, tree: Any) -> str:
    return write_yaml({**tree, "targets": [*tree["targets"], tree["targets"][0]]})


def _repeated_key(draw: st.DrawFn, tree: Any) -> str:
    key = draw(st.sampled_from(list(tree)))
    return f"{write_yaml(tree)}\n{key}: {draw(st.integers(0, 9))}\n"


def _not_yaml(draw: st.DrawFn, tree: Any) -> str:
    lines = write_yaml(tree).splitlines()
    where = draw(st.integers(0, len(lines)))
    return "\n".join([*lines[:where], draw(st.sampled_from(_UNREADABLE)), *lines[where:]])


_UNREADABLE = [
    "\tkey: 1",
    "key: [1, 2",
    "key: {a: 1",
    "key: 'open",
    "@at",
    "key: *nobody",
    "\x00",
    "key: \ud800",
    "%TAG",
]
"""Lines that are invalid YAML anywhere in a text."""


def _not_a_mapping(draw: st.DrawFn, tree: Any) -> str:
    texts = ["", "# nothing\n", "[]", "3", "scenario", "null", "- seed: 1", "---\n---\n", write_yaml([tree])]
    return draw(st.sampled_from(texts))


def _deeply_nested(draw: st.DrawFn, tree: Any) -> str:
    depth = draw(st.sampled_from([50, 1000, 20000]))
    opening, closing = draw(st.sampled_from([("[", "]"), ("{a: ", "}")]))
    return f"background: {opening * depth}1{closing * depth}"


def _alias_bomb(draw: st.DrawFn, tree: Any) -> str:
    """Return an alias bomb: each list holds the list before it ten times."""
    lines = ["a0: &a0 [1]"] + [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 12)]
    return "\n".join(lines)


_FAULTS: dict[str, Callable[[st.DrawFn, Any], str]] = {
    "an unknown key": _unknown_key,
    "an unusable number": _unusable_number,
    "a wrong type": _wrong_type,
    "an unknown kind": _unknown_kind,
    "a missing key": _missing_key,
    "an unknown id": _unknown_id,
    "a repeated id": _repeated_id,
    "a repeated key": _repeated_key,
    "invalid YAML": _not_yaml,
    "a text that is not a mapping": _not_a_mapping,
    "deep nesting": _deeply_nested,
    "an alias bomb": _alias_bomb,
}


@st.composite
def damaged_recordings(draw: st.DrawFn, whole: bytes) -> bytes:
    """Draw a recording's bytes with one to three damages: reading them fails or gives the same frames."""
    data = whole
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, max(len(data) - 1, 0)))
        stop = min(start + draw(st.integers(1, 4096)), len(data))
        damage = draw(st.sampled_from(_DAMAGES))
        data = damage(draw, data[:start], data[start:stop], data[stop:])
    return data


def _flipped(draw: st.DrawFn, before: bytes, span: bytes, after: bytes) -> bytes:
    mask = draw(st.integers(1, 255))
    return before + bytes(byte ^ mask for byte in span[:1]) + span[1:] + after


def _blank(draw: st.DrawFn, before: bytes, span: bytes, after: bytes) -> bytes:
    return before + draw(st.sampled_from([b"\0", b"\xff"])) * len(span) + after


def _inserted(draw: st.DrawFn, before: bytes, span: bytes, after: bytes) -> bytes:
    return before + draw(st.binary(min_size=1, max_size=64)) + span + after


def _number(draw: st.DrawFn, before: bytes, span: bytes, after: bytes) -> bytes:
    """Overwrite 8 bytes with a number that is too large for a length or an offset."""
    number = draw(st.sampled_from([0, 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1])).to_bytes(8, "little")
    return before + number + (span + after)[8:]


_DAMAGES: list[Callable[[st.DrawFn, bytes, bytes, bytes], bytes]] = [
    _flipped,
    lambda draw, before, span, after: before,
    lambda draw, before, span, after: span + after,
    lambda draw, before, span, after: before + after,
    lambda draw, before, span, after: before + span + span + after,
    _blank,
    _inserted,
    _number,
]
"""Damages to a span of a file: a byte flipped; the end, the beginning or the span lost; the span doubled or blank;
bytes inserted or overwritten."""
