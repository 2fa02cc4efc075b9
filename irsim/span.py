"""Which frames are asked for."""

from __future__ import annotations

from irsim.errors import whole


def span(start: int, stop: int | None, length: int) -> range:
    """Numbers of the frames start .. stop-1 of `length`; past the last one there are none.

    InputError for a number below 0 and for what is no whole number.
    """
    return range(whole("start", start), length if stop is None else min(whole("stop", stop), length))
