"""Settings that --without switches off: their names in a tree of parts, and the tree without them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

from irsim.config.base import AnyPart, KeyPath, NamedKind, Part


def switches(part: Part, prefix: str = "") -> Iterator[tuple[str, KeyPath]]:
    """Yield the name and the key path of each setting that has an effect and that --without can switch off, in a part
    and its inner parts.

    prefix   of the names: 'ID.' of the nearest part with an id
    """
    for name, (key, *nothing) in _own_switches(part).items():
        if getattr(part, key) not in nothing:
            yield prefix + name, (key,)
    for key in type(part).model_fields:
        value = getattr(part, key)
        several = isinstance(value, tuple)
        for index, inner in enumerate(value if several else (value,)):
            if isinstance(inner, Part):
                for name, place in switches(inner, _switch_prefix(inner, prefix)):
                    yield name, (key, index, *place) if several else (key, *place)


def switched_off(part: AnyPart, names: Collection[str], prefix: str = "") -> AnyPart:
    """Return the part with the settings `names` switched off; the part itself if nothing changes."""
    if not names:
        return part
    changes = {key: nothing for name, (key, nothing, *_) in _own_switches(part).items() if prefix + name in names}
    for key in type(part).model_fields:
        if key not in changes:
            value = getattr(part, key)
            if isinstance(value, tuple):
                other: Any = tuple(_value_off(each, names, prefix) for each in value)
            else:
                other = _value_off(value, names, prefix)
            if other != value:
                changes[key] = other
    return part.model_copy(update=changes) if changes else part


def _value_off(value: Any, names: Collection[str], prefix: str) -> Any:
    return switched_off(value, names, _switch_prefix(value, prefix)) if isinstance(value, Part) else value


def _own_switches(part: Part) -> dict[str, tuple[Any, ...]]:
    """Return the switches of a part's class and its bases."""
    bases = reversed(type(part).__mro__)
    return {name: setting for base in bases for name, setting in vars(base).get("switches", {}).items()}


def _switch_prefix(part: Part, prefix: str) -> str:
    name = part.name if isinstance(part, NamedKind) else getattr(part, "id", None)
    return f"{name}." if isinstance(name, str) else prefix
