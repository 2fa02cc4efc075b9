"""All parts that may stand in a scenario, for contracts over every key."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from irsim.config.base import Part
from irsim.config.schema import Slot


def slots(root: type[Part]) -> Iterator[tuple[str, Slot]]:
    """Yield each slot below a part with its place, such as 'camera.noise.ar1.rho'; a class that recurs only once."""
    seen: set[type[Part]] = set()

    def of_part(part: type[Part], place: str) -> Iterator[tuple[str, Slot]]:
        if part not in seen:
            seen.add(part)
            for name, field in part.model_fields.items():
                yield from of_slot(Slot.of(field.annotation, field.metadata), f"{place}.{name}".lstrip("."))

    def of_slot(slot: Slot, place: str) -> Iterator[tuple[str, Slot]]:
        yield place, slot
        if len(slot.choices) > 1:
            for choice in slot.choices:
                yield from of_slot(choice, place)
        elif slot.family is not None:
            for word, kind in slot.family:
                yield from of_part(kind, f"{place}.{word}")
        elif slot.is_list or slot.is_table:
            for item in get_args(slot.annotation):
                if item is not Ellipsis:
                    yield from of_slot(Slot.of(item), place)
        elif (part := slot.part(None)) is not None:
            yield from of_part(part, place)

    yield from of_part(root, "")


def parts(root: type[Part]) -> list[type[Part]]:
    """Return the part and all that may stand in it."""
    found = [root]
    for _, slot in slots(root):
        if slot.family is not None:
            found += [kind for _, kind in slot.family]
        elif (part := slot.part(None)) is not None:
            found.append(part)
    return list(dict.fromkeys(found))
