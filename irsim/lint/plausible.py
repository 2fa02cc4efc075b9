"""Values that are allowed and yet hardly meant, such as a temperature in degrees Celsius."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from irsim.config.base import KeyPath
from irsim.config.fields import Plausible
from irsim.config.schema import Slot
from irsim.errors import Notice


def implausible(slot: Slot, value: Any, at: KeyPath = ()) -> Iterator[Notice]:
    """A notice for each number in the plain tree `value`, which stands in `slot`, that is outside of the
    `Plausible` range of its field."""
    if isinstance(value, dict | list):
        for step, item in value.items() if isinstance(value, dict) else enumerate(value):
            inner = slot.child(value, step)
            if inner is not None:
                yield from implausible(inner, item, (*at, step))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        for plausible in slot.metadata:
            if isinstance(plausible, Plausible) and not plausible.low <= value <= plausible.high:
                yield Notice(at, f"{value!r} is allowed but hardly meant; plausible: {plausible}")
