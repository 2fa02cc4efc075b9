"""Exceptions of irsim, checks of arguments, texts of messages, and the start of commands. All its imports are fast."""

from __future__ import annotations

import _thread
import importlib
import operator
import os
import re
import reprlib
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any, NamedTuple, NoReturn

_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters except tab and line feed, line and direction marks, and surrogates."""

REPEAT_AFTER_S = 0.01
"""Delay, s, before a lost Ctrl-C is raised again. By then the callback that dropped the Ctrl-C has ended."""


class IrsimError(Exception):
    """Base class of all exceptions that irsim raises on purpose. ``str(error)`` is printable."""

    def __str__(self) -> str:
        return printable(super().__str__())


class InputError(IrsimError):
    """Wrong input: a scenario, a recording, an argument or an option (exit status 2).

    The text has one line for each fault, with its position.
    """


class Notice(NamedTuple):
    """Warning about a valid scenario: the key path of its cause and a message."""

    at: tuple[str | int, ...]
    message: str


def whole_number(name: str, given: Any, least: int = 0) -> int:
    """Return the integer `given` (Python's or numpy's); InputError for other types and below `least`."""
    try:
        number = as_int(given)
    except TypeError:
        raise InputError(f"{name} {given!r}: allowed: a whole number, {least} or more") from None
    if number < least:
        raise InputError(f"{name} {number}: allowed: {least} or more")
    return number


def frame_number(given: Any, length: int, owner: str) -> int:
    """Return the index `given` of one of `length` frames.

    Raises IndexError if there is no such frame and InputError if `given` is no integer.
    """
    try:
        number = as_int(given)
    except TypeError:
        raise InputError(f"frame {given!r}: allowed: a whole number, 0 to {length - 1}") from None
    if not 0 <= number < length:
        raise IndexError(f"frame {number}: {owner} has frames 0 to {length - 1}")
    return number


def parse_frame_range(text: str, length: int | None = None) -> range:
    """Return the frame numbers of the option `--frames`: '10' gives 0 .. 9 and '5:9' gives 5 .. 8.

    Raises InputError for any other text and for a range past the end of a source of `length` frames.
    """
    first, colon, last = text.partition(":")
    start, stop = (first, last) if colon else ("0", first)
    if start.isdecimal() and stop.isdecimal():
        found = range(int(start), int(stop))
        if found and (length is None or found.stop <= length):
            return found
    within = "" if length is None else f", within 0:{length}"
    raise InputError(f"--frames {text}: no such range; allowed: N above 0, or A:B with A below B{within}")


def as_int(given: Any) -> int:
    """Return an integer as int; TypeError for anything else and for bool."""
    if isinstance(given, bool):
        raise TypeError
    return operator.index(given)


def is_number(given: Any) -> bool:
    """Return True if `given` is a number of Python or numpy and no bool."""
    import numpy as np  # slow to import, and many commands do without

    return isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)


def expect_text(name: str, given: Any) -> None:
    """Raise InputError unless `given` is text that a file can hold (no surrogates)."""
    if not isinstance(given, str) or any("\ud800" <= letter <= "\udfff" for letter in given):
        raise InputError(f"{name} {reprlib.repr(given)}: is no text; allowed: text")


def expect_source(action: str, given: Any) -> None:
    """Raise InputError unless `given`, the argument of `action`, is a Source."""
    if not callable(getattr(given, "pairs", None)):
        raise InputError(f"{action} of a {type(given).__name__}; allowed: a Source, such as irsim.open_source gives")


def printable(text: str) -> str:
    """Return the text with characters that control a terminal, or that no file can hold, escaped as in Python."""
    return _UNPRINTABLE.sub(lambda found: ascii(found[0])[1:-1], text)


def one_line(text: str) -> str:
    """Return a `printable` text with line feeds escaped, too."""
    return printable(text).replace("\n", "\\n")


def counted(count: int, noun: str) -> str:
    """Return '1 frame', '2 frames'."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def decimal_text(value: float, digits: int) -> str:
    """Return the number with `digits` significant digits and no exponent: 100 where `g` gives 1e+02."""
    from decimal import Decimal  # slow to import, and few messages need it

    text = f"{value:.{digits}g}"
    return f"{Decimal(text):f}" if "e" in text else text


def exit_status_text(code: int | None) -> str:
    """Return a process's exit code in words: 'SIGKILL', 'exit status 1'."""
    if code is None or code >= 0:
        return f"exit status {code}"
    with suppress(ValueError):
        return signal.Signals(-code).name
    return f"signal {-code}"


@contextmanager
def exits_refused() -> Iterator[None]:
    """Raise SystemExit where code in the block calls `os._exit`, which would end the program without a word."""
    exit_now = os._exit
    active = True

    def refuse(code: int) -> NoReturn:
        if active:
            raise SystemExit(f"os._exit({code}) is called")
        exit_now(code)

    os._exit = refuse  # type: ignore[assignment]  # typeshed names its argument
    try:
        yield
    finally:
        os._exit, active = exit_now, False


def lazy_exports(package: str, modules: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package that imports its public names on first use (PEP 562).

    modules   public name -> module that defines it
    """

    def find(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(modules[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return [*vars(sys.modules[package]), *modules]

    return find, names


def run_command(name: str, module: str) -> None:
    """Import a command's module and call its `main`. Ctrl-C ends the command quietly, also while it is imported."""
    keep_interrupts()
    try:
        importlib.import_module(module).main()
    except KeyboardInterrupt:
        print(f"{name}: stopped", file=sys.stderr)
        sys.exit(130)


def keep_interrupts() -> None:
    """Raise KeyboardInterrupt again where Python drops it.

    Python ignores exceptions in callbacks and finalisers, and each import of a module ends in a callback: a command
    that is interrupted in such a callback would continue.
    """
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            before(lost)
            return
        signal.signal(signal.SIGINT, signal.default_int_handler)  # an earlier signal may have set SIGINT to be ignored
        _thread.start_new_thread(_interrupt, (_thread.get_ident(),))

    sys.unraisablehook = hook


def _interrupt(main_thread: int) -> None:
    time.sleep(REPEAT_AFTER_S)
    if sys.platform == "win32":
        _thread.interrupt_main()
    else:
        signal.pthread_kill(main_thread, signal.SIGINT)  # unlike interrupt_main it also ends a wait
