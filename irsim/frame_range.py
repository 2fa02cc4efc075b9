"""Which frames are asked for, and as which picture."""

from __future__ import annotations

from irsim.errors import InputError, whole


def span(start: int, stop: int | None, length: int) -> range:
    """Numbers of the frames start .. stop-1 of `length`; past the last one there are none.

    InputError for a number below 0 and for what is no whole number.
    """
    return range(whole("start", start), length if stop is None else min(whole("stop", stop), length))


def check_view(input: object) -> None:
    """InputError for what is no name of a picture of a frame, see `irsim.Input`."""
    if input not in ("display", "counts"):
        raise InputError(f"input {input!r}: allowed: 'display' (the 8-bit picture) or 'counts' (the detector's)")


def parsed(text: str, length: int | None = None) -> range:
    """Numbers of the frames that `--frames` asks for: '10' is 0 .. 9, and '5:9' is 5 .. 8.

    InputError for what is no such range and, of a source of `length` frames, for one that goes past its end.
    """
    first, colon, last = text.partition(":")
    start, stop = (first, last) if colon else ("0", first)
    if start.isdecimal() and stop.isdecimal():
        found = range(int(start), int(stop))
        if found and (length is None or found.stop <= length):
            return found
    within = "" if length is None else f", within 0:{length}"
    raise InputError(f"--frames {text}: no such range; allowed: N above 0, or A:B with A below B{within}")
