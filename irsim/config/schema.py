"""Allowed values under each key of a tree of parts, for error messages and overrides."""

from __future__ import annotations

import re
import types
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types as at
from pydantic.fields import FieldInfo

from irsim.config.base import Family, KeyPath, NamedKind, Part
from irsim.config.fields import Items, Located
from irsim.config.yaml_text import dotted

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")

_WORDS = {Any: "any value", int: "a whole number", float: "a number", bool: "true or false", str: "text"}


@dataclass(frozen=True)
class Slot:
    """Type and constraints of the value under a key or list index of a part, from pydantic's fields."""

    annotation: Any
    metadata: tuple[Any, ...] = ()

    @classmethod
    def of(cls, annotation: Any, metadata: Iterable[Any] = ()) -> Slot:
        """Return the slot of a type hint without `Annotated` and the like; `X | None` gives the slot of X."""
        found = list(metadata)
        while True:
            if get_origin(annotation) is Annotated:
                annotation, *extra = get_args(annotation)
                for item in extra:
                    found += item.metadata if isinstance(item, FieldInfo) else [item]
            elif len(choices := [each for each in _choices(annotation) if each is not type(None)]) == 1:
                if choices[0] is annotation:
                    return cls(annotation, tuple(found))
                annotation = choices[0]
            else:
                return cls(annotation, tuple(found))

    @property
    def choices(self) -> list[Slot]:
        """Alternatives of a union; otherwise the slot itself alone."""
        return [Slot.of(each, self.metadata) for each in _choices(self.annotation) if each is not type(None)]

    @property
    def family(self) -> Family | None:
        return next((item for item in self.metadata if isinstance(item, Family)), None)

    @property
    def is_list(self) -> bool:
        return get_origin(self.annotation) is tuple

    @property
    def is_file(self) -> bool:
        """True for a file's name."""
        return any(isinstance(item, Located) for item in self.metadata)

    @property
    def is_table(self) -> bool:
        """True for a mapping with free keys, such as `vary`."""
        return get_origin(self.annotation) is Mapping

    def part(self, value: Any) -> type[Part] | None:
        """Return the class of the part that `value`, a mapping in this slot, describes; None where it is unknown."""
        if self.family is not None:
            word = value.get("kind") if isinstance(value, Mapping) else None
            try:
                return self.family.find(word)
            except ValueError:
                return None
        if isinstance(self.annotation, type) and issubclass(self.annotation, Part):
            return self.annotation
        return None

    def child(self, value: Any, step: str | int) -> Slot | None:
        """Return the slot of the key or list index `step` of `value`, which is in this slot; None if unknown."""
        if self.is_list and isinstance(step, int):
            items = get_args(self.annotation)
            if len(items) == 2 and items[1] is Ellipsis:
                return Slot.of(items[0])
            return Slot.of(items[step]) if 0 <= step < len(items) else None
        if self.is_table:
            return Slot.of(get_args(self.annotation)[1])
        part = self.part(value)
        field = part.model_fields.get(str(step)) if part is not None else None
        return None if field is None else Slot.of(field.annotation, field.metadata)

    def words(self) -> str:
        """Return the allowed values in words."""
        if self.family is not None:
            return f"a mapping with the key 'kind': {', '.join(self.family.kinds)} or module:Class"
        if len(self.choices) > 1:
            return " or ".join(choice.words() for choice in self.choices)
        if get_origin(self.annotation) is Literal:
            return ", ".join(map(repr, get_args(self.annotation)))
        if self.is_list:
            return self._list_words()
        if self.is_table:
            return f"a mapping, under each key {Slot.of(get_args(self.annotation)[1]).words()}"
        part = self.part(None)
        if part is not None:
            return f"a mapping with the keys {', '.join(part.model_fields)}"
        words = _WORDS.get(self.annotation, "")
        return ", ".join(filter(None, [words, *self._limits()]))

    def _list_words(self) -> str:
        items = get_args(self.annotation)
        if items[-1] is Ellipsis:
            return ", ".join([f"a list, each item {Slot.of(items[0]).words()}", *self._limits()])
        words = [Slot.of(item).words() for item in items]
        named = next((f" {item.names}" for item in self.metadata if isinstance(item, Items)), "")
        each = f"each {words[0]}" if len(set(words)) == 1 else "; ".join(words)
        return f"a list of {len(items)}{named}, {each}"

    def _limits(self) -> list[str]:
        limits = []
        low, high = self._find(at.Ge, "ge"), self._find(at.Le, "le")
        if low is not None and high is not None:
            limits.append(f"from {low} to {high}")
        elif low is not None:
            limits.append(f"{low} or more")
        above, below = self._find(at.Gt, "gt"), self._find(at.Lt, "lt")
        limits += [f"above {above}"] if above is not None else []
        limits += [f"below {below}"] if below is not None else []
        limits += [f"at most {high}"] if high is not None and low is None else []
        least, most = self._find(at.MinLen, "min_length"), self._find(at.MaxLen, "max_length")
        unit = "items" if self.is_list else "characters"
        limits += [f"at least {least} {unit if least > 1 else unit.removesuffix('s')}"] if least is not None else []
        limits += [f"at most {most} {unit}"] if most is not None else []
        pattern = next((item.pattern for item in self.metadata if hasattr(item, "pattern")), None)
        limits += [_pattern_words(pattern)] if pattern is not None else []
        return limits

    def _find(self, constraint: type, attribute: str) -> Any:
        return next((getattr(item, attribute) for item in self.metadata if isinstance(item, constraint)), None)


def item_name(slot: Slot | None, item: Any) -> str | None:
    """Return the name of a list item in overrides and errors: its id, its default id, or its kind."""
    part = slot.part(item) if slot is not None else None
    if part is None or not isinstance(item, Mapping) or "id" not in part.model_fields:
        return None
    name = item.get("id") or part.model_fields["id"].default
    if name is None and issubclass(part, NamedKind):
        name = item.get("kind")
    return name if isinstance(name, str) and NAME.fullmatch(name) else None


def item_names(slot: Slot, items: Sequence[Any]) -> list[str]:
    """Return a name for each item of a list in `slot`: its name if unique, else its number."""
    names = [item_name(slot.child(items, index), item) for index, item in enumerate(items)]
    uses = Counter(names)
    return [str(index) if name is None or uses[name] > 1 else name for index, name in enumerate(names)]


def path_text(path: KeyPath, root: Slot, value: Any, known: dict[KeyPath, list[str]] | None = None) -> str:
    """Return 'targets.jet.path.speed': a path with names of list items in place of numbers.

    known  names of the items of lists, by the lists' paths, kept between calls for one value
    """
    steps: list[str] = []
    known = {} if known is None else known
    slot: Slot | None = root
    for place, step in enumerate(path):
        is_item = isinstance(step, int) and isinstance(value, list) and 0 <= step < len(value)
        if is_item and slot is not None and path[:place] not in known:
            known[path[:place]] = item_names(slot, value)
        steps.append(known[path[:place]][int(step)] if is_item and slot is not None else str(step))
        slot = slot.child(value, step) if slot is not None else None
        value = member(value, step)
    return dotted(tuple(steps))


def member(value: Any, step: str | int) -> Any:
    """Return a key's value or a list's item; None where there is none."""
    if isinstance(value, dict):
        return value.get(step)
    if isinstance(value, list) and isinstance(step, int) and 0 <= step < len(value):
        return value[step]
    return None


def _choices(annotation: Any) -> tuple[Any, ...]:
    return get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,)


def _pattern_words(pattern: str) -> str:
    if pattern == f"^{NAME.pattern}$":
        return "of letters, digits, _ and -, beginning with a letter or _"
    return f"matching {pattern}"
