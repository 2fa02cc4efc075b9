"""The one exception family of irsim; its text is what a user sees."""

from __future__ import annotations

import operator
import re
import reprlib
import signal
from contextlib import suppress
from typing import Any, NamedTuple

_COMMANDS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters but tab and line feed, those that break or turn lines around, and halves of letters: what a
terminal obeys, and what no file of text can hold."""


def printable(text: str) -> str:
    """A text from elsewhere as it can be shown: what a terminal would obey stands there as Python writes it."""
    return _COMMANDS.sub(lambda found: ascii(found[0])[1:-1], text)


class IrsimError(Exception):
    """Anything irsim raises on purpose. ``str(error)`` is ready to be shown to a user: it is `printable`."""

    def __str__(self) -> str:
        return printable(super().__str__())


class InputError(IrsimError):
    """What the user gave is wrong: a scenario, a recording, an option (exit status 2).

    The text is one line for each thing that is wrong, each with its place.
    """


def whole(name: str, given: Any, least: int = 0) -> int:
    """The whole number that a caller gave, numpy's too; InputError for anything else and below `least`."""
    try:
        number = as_whole(given)
    except TypeError:
        raise InputError(f"{name} {given!r}: allowed: a whole number, {least} or more") from None
    if number < least:
        raise InputError(f"{name} {number}: allowed: {least} or more")
    return number


def expect_source(what: str, given: Any) -> None:
    """InputError where `what` is asked of anything else than a Source."""
    if not callable(getattr(given, "pairs", None)):
        raise InputError(f"{what} of a {type(given).__name__}; allowed: a Source, such as irsim.open_source gives")


def frame_number(given: Any, length: int, whose: str) -> int:
    """The number of a frame of `length` that a caller gave, numpy's too. IndexError where there is no such frame, as of
    any sequence, InputError for anything else than a whole number."""
    try:
        number = as_whole(given)
    except TypeError:
        raise InputError(f"frame {given!r}: allowed: a whole number, 0 to {length - 1}") from None
    if not 0 <= number < length:
        raise IndexError(f"frame {number}: {whose} has frames 0 to {length - 1}")
    return number


def as_whole(given: Any) -> int:
    """A whole number as int. TypeError for anything else; True is none, though Python has it for 1."""
    if isinstance(given, bool):
        raise TypeError
    return operator.index(given)


def is_number(given: Any) -> bool:
    """Whether a caller gave a number, Python's or numpy's; True is none, though Python has it for 1."""
    import numpy as np  # commands that only look at files must not wait for it

    return isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)


def expect_text(name: str, given: Any) -> None:
    """InputError where a caller gave anything else than text, or half of a letter, which no file can hold."""
    if not isinstance(given, str) or any("\ud800" <= letter <= "\udfff" for letter in given):
        raise InputError(f"{name} {reprlib.repr(given)}: is no text; allowed: text")


def how_it_ended(code: int | None) -> str:
    """A process's exit code in words: 'SIGKILL', 'exit status 1'."""
    if code is None or code >= 0:
        return f"exit status {code}"
    with suppress(ValueError):
        return signal.Signals(-code).name
    return f"signal {-code}"


class Notice(NamedTuple):
    """Something legal that may not be meant: its place in the tree, and what to say of it."""

    at: tuple[str | int, ...]
    what: str
