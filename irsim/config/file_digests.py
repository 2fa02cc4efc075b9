"""Files that parts of a scene are read from: names that hold from anywhere, and digests of what is in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, LiteralString

from pydantic_core import PydanticCustomError

from irsim.errors import InputError

FILE, DIGEST = "file", "digest"
"""The key that names the file that a part is read from, and beside it that for the digest of the file's bytes."""

NO_FILE: LiteralString = "no_file"
"""The type of the error that a part's file is not there."""

Stamp = tuple[int, int, int]
"""What tells a file from one that has taken its place, without reading it: its number, its bytes, when written, ns."""


def stamp(file: str | Path | int) -> Stamp:
    """Of a file by its name, or by its number where it is open. OSError or ValueError where there is none to be had."""
    state = os.stat(file)
    return state.st_ino, state.st_size, state.st_mtime_ns


def whole_name(name: str) -> str:
    """The name as it holds from any working directory. Links in its folder are followed, so that `..` means what it
    says; one that is the file itself is not, for its name ends as the file's kind asks."""
    if not name:
        return name
    folder, file = os.path.split(name)
    try:
        return os.path.join(os.path.realpath(folder), file)
    except ValueError:  # no file can have it: told by who opens it
        return name


def same_name(one: object, other: object) -> bool:
    """Do both name one file?"""
    return isinstance(one, str) and isinstance(other, str) and whole_name(one) == whole_name(other)


def name_from(folder: Path, name: str) -> str:
    """A whole name as it is found from a folder: relative, so that both move together; whole where they share nothing
    but the root, or not even that."""
    here = os.path.realpath(folder)
    try:
        shared = Path(os.path.commonpath([here, name]))
    except ValueError:  # on two drives
        return name
    return name if shared == shared.parent else Path(os.path.relpath(name, here)).as_posix()


def with_digest(given: Any, digest_of: Callable[[str], str]) -> Any:
    """The mapping of a part that is read from its `file`, with the file's digest filled in.

    digest_of   of a file's name; InputError, OSError and ValueError say why it cannot be read

    PydanticCustomError where it cannot, and where a digest is given that is another. A mapping whose file or digest is
    no text is handed back, for its fields to tell.
    """
    if not isinstance(given, Mapping):
        return given
    if not (isinstance(given.get(FILE), str) and isinstance(given.get(DIGEST, ""), str)):
        return given
    name = whole_name(given[FILE])
    if (fault := _fault_of(name)) is not None:
        raise _wrong(FILE, fault)
    try:
        found = digest_of(name)
    except OSError as error:
        raise _wrong(FILE, f"{name}: cannot be read: {error.strerror or error}", _error_type(name)) from None
    except (InputError, ValueError) as error:
        raise _wrong(FILE, str(error), _error_type(name)) from None
    if given.get(DIGEST) and given[DIGEST] != found:
        raise _wrong(DIGEST, f"{name} has changed: its digest is {found}; allowed: that, or no key {DIGEST}")
    return {**given, DIGEST: found}


def _fault_of(name: str) -> str | None:
    """Why no file can have the name."""
    if not name:
        return "the name is empty; allowed: the name of a file"
    try:
        possible = b"\0" not in os.fsencode(name)
    except UnicodeEncodeError:
        possible = False
    return None if possible else f"{name}: no file can have this name; allowed: no zero bytes, no halves of letters"


def unchanged(file: str, digest: str, now: str) -> None:
    """InputError where a file's digest was another when the scene was read than it is `now`."""
    if now != digest:
        raise InputError(f"{file}: was changed after the scene was read; read the scene again")


def _error_type(name: str) -> LiteralString:
    """Of the error that a file cannot be read: where it is gone, who tells it says how to name another."""
    return "file" if os.path.exists(name) else NO_FILE


def _wrong(key: str, what: str, kind: LiteralString = "file") -> PydanticCustomError:
    return PydanticCustomError(kind, "{what}", {"what": what, "at": (key,)})
