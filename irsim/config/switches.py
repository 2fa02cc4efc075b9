"""What is set within parts and can be switched off by name: each part's `switches`, wherever it stands."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any, TypeVar

from irsim.config.base import KeyPath, NamedKind, Part

AnyPart = TypeVar("AnyPart", bound=Part)


def switches(part: Part, owner: str = "") -> Iterator[tuple[str, KeyPath]]:
    """Name, and place within the part, of all in it and below that can be switched off and does something.

    owner   what the names begin with: 'ID.' of the nearest part that has an id
    """
    for name, (key, *nothing) in _own(part).items():
        if getattr(part, key) not in nothing:
            yield owner + name, (key,)
    for key in type(part).model_fields:
        value = getattr(part, key)
        several = isinstance(value, tuple)
        for index, inner in enumerate(value if several else (value,)):
            if isinstance(inner, Part):
                for name, place in switches(inner, _owner(inner, owner)):
                    yield name, (key, index, *place) if several else (key, *place)


def less(part: AnyPart, names: Collection[str], owner: str = "") -> AnyPart:
    """The same part with what is of those names at the value that does nothing; itself where that is nothing."""
    if not names:
        return part
    changes = {key: nothing for name, (key, nothing, *_) in _own(part).items() if owner + name in names}
    for key in type(part).model_fields:
        if key not in changes:
            value = getattr(part, key)
            other = tuple(_less(each, names, owner) for each in value) if isinstance(value, tuple) else None
            other = _less(value, names, owner) if other is None else other
            if other != value:
                changes[key] = other
    return part.model_copy(update=changes) if changes else part


def _less(value: Any, names: Collection[str], owner: str) -> Any:
    return less(value, names, _owner(value, owner)) if isinstance(value, Part) else value


def _own(part: Part) -> dict[str, tuple[Any, ...]]:
    """The switches of a part's class and its bases."""
    bases = reversed(type(part).__mro__)
    return {name: what for base in bases for name, what in vars(base).get("switches", {}).items()}


def _owner(part: Part, owner: str) -> str:
    """What the names of a part's switches begin with, below one whose begin with `owner`."""
    name = part.name if isinstance(part, NamedKind) else getattr(part, "id", None)
    return f"{name}." if isinstance(name, str) else owner
