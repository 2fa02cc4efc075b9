"""Which frames are asked for."""

from __future__ import annotations

import operator

from irsim.errors import InputError


def span(start: int, stop: int | None, length: int) -> range:
    """Numbers of the frames start .. stop-1 of `length`; past the last one there are none.

    InputError for a number below 0, TypeError for what is no whole number.
    """
    for name, number in (("start", start), ("stop", stop)):
        if number is not None and operator.index(number) < 0:
            raise InputError(f"{name} {number}: allowed: 0 or more")
    return range(start, length if stop is None else min(stop, length))
