"""Input files: their kind by content, absolute and relative names, and digests of files that parts are read from."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, LiteralString

from irsim.errors import InputError

if TYPE_CHECKING:
    from pydantic_core import PydanticCustomError

MCAP_MAGIC = b"\x89MCAP"
"""First bytes of an MCAP file (MCAP specification, 'Magic')."""

LONGEST_PIPED = 1 << 26
"""Largest number of bytes of a text that comes through a pipe."""

FILE, DIGEST = "file", "digest"
"""Keys of the file that a part is read from and of the digest of its bytes."""

NO_FILE: LiteralString = "no_file"
"""Type of the error for a part's missing file."""

Stamp = tuple[int, int, int]
"""Inode, size and time of modification, ns: different for a replaced file."""


def path_of(given: object) -> Path:
    """Return the path given as text or path; InputError for anything else."""
    if not isinstance(given, str | os.PathLike):
        raise InputError(f"{given!r}: is no path; allowed: text or a path")
    return Path(given)


def is_there(path: str | os.PathLike[str]) -> bool:
    """Return True if the path exists; False for impossible names, too long or with a zero byte."""
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def is_irregular(path: str | os.PathLike[str]) -> bool:
    """Return True if the path exists and is neither a file on a disk nor a folder."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def check_input(path: str | os.PathLike[str], allowed: str) -> None:
    """Raise InputError for a device or a pipe, which might never end; `allowed` names the alternative.

    A folder and a missing file pass: opening them fails with its own message.
    """
    if is_irregular(path):
        raise InputError(f"{path}: is no regular file; allowed: {allowed}")


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Return True if the file is a recording: by its content, or by its name even if it is broken or missing."""
    path = path_of(path)
    return path.suffix == ".mcap" or begins_as_recording(path)


def begins_as_recording(path: Path) -> bool:
    """Return True if the file begins with `MCAP_MAGIC`; False where it cannot be read."""
    return _head(path, len(MCAP_MAGIC)) == MCAP_MAGIC


def is_binary(path: Path) -> bool:
    """Return True if the first 8 kB of the file hold a zero byte, as in pictures; False where it cannot be read."""
    return b"\0" in _head(path, 8192)


def _head(path: Path, length: int) -> bytes:
    """Return the first bytes of a regular file; none where it cannot be read."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as file:
            return file.read(length)
    except (OSError, ValueError):
        return b""


def text_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of a text file, or of a shell's `<(command)`, which is read once and kept.

    Raises InputError for other pipes and for devices, and for a pipe of more than LONGEST_PIPED bytes; OSError and
    ValueError where there is nothing to read.
    """
    state = os.stat(path)
    # A shell's pipe exists only as an open file: its link is dangling, or lies in /dev/fd.
    real = os.path.realpath(path)
    if stat.S_ISFIFO(state.st_mode) and (real.startswith("/dev/fd/") or not os.path.exists(real)):
        return _piped(os.fspath(path), state.st_dev, state.st_ino)
    check_input(path, "a file, or a shell's <(command)")
    return Path(path).read_bytes()


@lru_cache(maxsize=16)
def _piped(path: str, device: int, number: int) -> bytes:
    """Return the bytes from the pipe of inode `number`; InputError where they are too many."""
    with open(path, "rb") as file:
        found = file.read(LONGEST_PIPED + 1)
    if len(found) > LONGEST_PIPED:
        raise InputError(f"{path}: more than {LONGEST_PIPED >> 20} MB come through this pipe; allowed: text that ends")
    return found


def stamp(file: str | Path | int) -> Stamp:
    """Return the stamp of a file by its name or descriptor. OSError or ValueError where there is none."""
    state = os.stat(file)
    return state.st_ino, state.st_size, state.st_mtime_ns


def absolute_name(name: str) -> str:
    """Return the absolute name, independent of the working directory.

    Links in its folder are followed, so that `..` means the parent. A link to the file itself is not followed, so that
    the suffix of its name is kept.
    """
    if not name:
        return name
    folder, file = os.path.split(name)
    try:
        return os.path.join(os.path.realpath(folder), file)
    except ValueError:  # no file can have this name: opening it fails
        return name


def same_name(one: object, other: object) -> bool:
    """Return True if both are names of one file."""
    return isinstance(one, str) and isinstance(other, str) and absolute_name(one) == absolute_name(other)


def relative_name(folder: Path, name: str) -> str:
    """Return an absolute name relative to a folder; unchanged where both share only the root."""
    here = os.path.realpath(folder)
    try:
        shared = Path(os.path.commonpath([here, name]))
    except ValueError:  # on two drives
        return name
    return name if shared == shared.parent else Path(os.path.relpath(name, here)).as_posix()


def with_digest(given: Any, digest_of: Callable[[str], str]) -> Any:
    """Return the mapping of a part with the digest of its `file`; validates both keys.

    digest_of   computes it from a file's name; raises InputError, OSError or ValueError

    Raises PydanticCustomError if no digest can be computed or the digest given differs. A mapping whose file or digest
    is no text is returned unchanged: validation of its fields reports the fault.
    """
    if not isinstance(given, Mapping):
        return given
    if not (isinstance(given.get(FILE), str) and isinstance(given.get(DIGEST, ""), str)):
        return given
    name = absolute_name(given[FILE])
    if (fault := _fault_of(name)) is not None:
        raise _file_error(FILE, fault)
    kind: LiteralString = "file" if os.path.exists(name) else NO_FILE
    try:
        found = digest_of(name)
    except OSError as error:
        raise _file_error(FILE, f"{name}: cannot be read: {error.strerror or error}", kind) from None
    except (InputError, ValueError) as error:
        raise _file_error(FILE, str(error), kind) from None
    if given.get(DIGEST) and given[DIGEST] != found:
        raise _file_error(DIGEST, f"{name} has changed: its digest is {found}; allowed: that, or no key {DIGEST}")
    return {**given, DIGEST: found}


def check_unchanged(file: str, digest: str, now: str) -> None:
    """Raise InputError if a file's present digest, `now`, is not `digest`, taken when the scene was read."""
    if now != digest:
        raise InputError(f"{file}: was changed after the scene was read; read the scene again")


def _fault_of(name: str) -> str | None:
    """Return the fault of a name that no file can have; None for a possible name."""
    if not name:
        return "the name is empty; allowed: the name of a file"
    try:
        possible = b"\0" not in os.fsencode(name)
    except UnicodeEncodeError:
        possible = False
    return None if possible else f"{name}: no file can have this name; allowed: no zero bytes, no surrogates"


def _file_error(key: str, message: str, kind: LiteralString = "file") -> PydanticCustomError:
    from pydantic_core import PydanticCustomError  # slow to import, and --help needs the rest of this file

    return PydanticCustomError(kind, "{message}", {"message": message, "at": (key,)})
