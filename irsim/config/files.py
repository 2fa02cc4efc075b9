"""Files: which are recordings; inputs that end; folders made; outputs are checked before any work, and whole or not
there at all."""

from __future__ import annotations

import io
import os
import re
import stat
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TextIO

from irsim.errors import InputError

if TYPE_CHECKING:  # commands that only look at files must not wait for numpy
    import numpy.typing as npt

MCAP_MAGIC = b"\x89MCAP"
"""First bytes of an MCAP file (MCAP specification, 'Magic')."""

LONGEST_PIPED = 1 << 26
"""Bytes of a text that comes through a pipe: more is taken for one that never ends."""


def path_of(given: object) -> Path:
    """The path that a caller gave as text or as a path; InputError for anything else."""
    if not isinstance(given, str | os.PathLike):
        raise InputError(f"{given!r}: is no path; allowed: text or a path")
    return Path(given)


def is_there(path: str | os.PathLike[str]) -> bool:
    """Whether there is something of that name; False for a name that no file can have, too long or with a zero byte."""
    try:
        return Path(path).exists()
    except (OSError, ValueError):
        return False


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Whether the file is a recording: one that begins as such, or that has the name of one, broken or none."""
    path = path_of(path)
    return path.suffix == ".mcap" or begins_as_recording(path)


def begins_as_recording(path: Path) -> bool:
    """Whether the file is a recording by its content; not where it cannot be read, or only once, as a pipe can."""
    return _beginning(path, len(MCAP_MAGIC)) == MCAP_MAGIC


def is_binary(path: Path) -> bool:
    """Whether the file holds what is in no text, a zero byte among its first 8192; not where it cannot be read, or only
    once."""
    return b"\0" in _beginning(path, 8192)


def _beginning(path: Path, length: int) -> bytes:
    """The first bytes of a regular file; none where it cannot be read."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as file:
            return file.read(length)
    except (OSError, ValueError):
        return b""


def check_input(path: str | os.PathLike[str], allowed: str) -> None:
    """InputError where a device or a pipe has that name: one may have no end, the other never begin, so that neither is
    opened. A folder passes, and so does a name that nothing has: who reads them tells.

    allowed   what may have the name instead, in words
    """
    if is_irregular(path):
        raise InputError(f"{path}: is no regular file; allowed: {allowed}")


def is_irregular(path: str | os.PathLike[str]) -> bool:
    """Whether there is something of that name that is neither a file on a disk nor a folder."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def text_bytes(path: str | os.PathLike[str]) -> bytes:
    """All that is in a file of text, or comes through a pipe without a name of its own, as a shell makes it of
    `<(command)`; as often as it is asked for, though a pipe can be read but once.

    InputError for other pipes and for devices, and for a pipe that goes on and on. OSError and ValueError where there
    is nothing to read.
    """
    state = os.stat(path)
    # A pipe of the shell is an open file only: the link to it leads nowhere, or is all that there is of it.
    real = os.path.realpath(path)
    if stat.S_ISFIFO(state.st_mode) and (real.startswith("/dev/fd/") or not os.path.exists(real)):
        return _piped(os.fspath(path), state.st_dev, state.st_ino)
    check_input(path, "a file, or a shell's <(command)")
    return Path(path).read_bytes()


@lru_cache(maxsize=16)
def _piped(path: str, device: int, number: int) -> bytes:
    """What comes through the pipe of that number of a device; InputError where it is too much."""
    with open(path, "rb") as file:
        found = file.read(LONGEST_PIPED + 1)
    if len(found) > LONGEST_PIPED:
        raise InputError(f"{path}: more than {LONGEST_PIPED >> 20} MB come through this pipe; allowed: text that ends")
    return found


def check_output(path: Path | None, *inputs: Path | None, endings: Sequence[str] = ()) -> None:
    """InputError where `path` cannot become a file, would replace one of `inputs`, or has none of `endings`.

    It cannot where its folder is missing, or where it is a folder or a device. `inputs` are what the
    command reads (a folder: every file in it), or its other outputs. `endings` are those that tell others what
    will be in it, such as ".mcap"; none: any. None, an output that nobody asked for, passes.
    """
    if path is None:
        return
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; allowed: an existing folder")
    if path.is_dir():
        raise InputError(f"{path}: is a folder; allowed: the name of a file")
    check_input(path, "the name of a file")
    real = path.resolve()
    for used in inputs:
        if used is not None and (
            used.resolve() == real or (used.is_dir() and path.exists() and used.resolve() in real.parents)
        ):
            raise InputError(f"{path}: would replace {used}, which this command needs; allowed: another name")
    if endings and path.suffix.lower() not in endings:
        raise InputError(f"{path}: allowed: a name that ends in {' or '.join(endings)}")


def make_folder(path: Path) -> None:
    """A folder, there already or made with those above it; InputError where none can be."""
    try:
        for place in (path, *path.parents):
            if place.exists() and not place.is_dir():
                which = "" if place == path else f"{place} "
                raise InputError(f"{path}: {which}is no folder; allowed: the name of a folder")
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: no folder can be made there: {error.strerror or error}") from None


def refuse_leftovers(folder: Path, stays: Callable[[str], bool], what: str) -> None:
    """InputError where a folder that a command fills holds files like its own of another call: both would be mixed up.

    stays   of a file's name: is it one of `what` the command writes, and not replaced by this call?
    """
    if left := _listed_in(folder, stays):
        raise InputError(
            f"{folder}: holds {what} of another call that would stay among the new ones, {left}; "
            "allowed: another folder, or the same without them"
        )


def refuse_others(folder: Path, other: Callable[[str], bool], what: str, command: str) -> None:
    """InputError where a folder that a command fills holds what is not the command's: whoever reads all that is in it
    would take both for one thing.

    other   of a file's name: is it one of `what`?
    """
    if there := _listed_in(folder, other):
        raise InputError(
            f"{folder}: holds {what}, {there}; allowed: a new or empty folder, or one that {command} wrote"
        )


def _listed_in(folder: Path, wanted: Callable[[str], bool]) -> str:
    """'NAME and N more' of such files in a folder; '' where there are none, or no folder. InputError where it cannot be
    read."""
    try:
        names = sorted(path.name for path in folder.iterdir() if wanted(path.name)) if folder.is_dir() else []
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror or error}") from None
    return "".join(names[:1]) + (f" and {len(names) - 1} more" if len(names) > 1 else "")


@contextmanager
def replacing(path: Path, tidy: bool = False) -> Iterator[BinaryIO]:
    """A file to write that takes its name when the block ends well and is gone when it does not.

    tidy   of what takes long to write: what was left beside it by processes that were killed is removed first
    """
    check_output(path)
    real = path.resolve()  # a link stays a link
    if tidy:
        _remove_leftovers(real)
    temporary = real.with_name(f".{real.name}.{os.getpid()}.tmp")
    try:
        with open(temporary, "wb") as file:
            _held(file)
            yield file
        os.replace(temporary, real)
    except OSError as error:
        # A failed write (a full disk) names no file; any other file's trouble is not ours to word.
        if error.filename not in (None, str(temporary)):
            raise
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(OSError):  # a read-only file system refuses even what is not there
            temporary.unlink(missing_ok=True)


def _remove_leftovers(real: Path) -> None:
    """Remove what processes that are no more left of an output: files that nobody holds, of none that is alive here."""
    alike = re.compile(rf"\.{re.escape(real.name)}\.(\d+)\.tmp")
    with suppress(OSError):  # a folder that cannot be read, or a file that another process has removed
        for path in list(real.parent.iterdir()):
            told = alike.fullmatch(path.name)
            if told is not None and not _alive(int(told[1])):
                with path.open("rb") as file:
                    if _held(file):
                        path.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    """Whether it is, where that can be asked; else as if it were."""
    if sys.platform == "win32":  # os.kill would end it
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def _held(file: BinaryIO) -> bool:
    """Hold a file, until it is closed or its process is no more, against other processes, on other machines too where
    the file system tells them; False where one of them has it."""
    if sys.platform != "win32":
        import fcntl

        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a file system without locks: the process's number alone tells
            pass
    return True


@contextmanager
def replacing_text(path: Path) -> Iterator[TextIO]:
    """The same for text: UTF-8, lines ended as they are written."""
    with replacing(path) as file, io.TextIOWrapper(file, encoding="utf-8", newline="") as text:
        yield text


def write_png(path: Path, picture: npt.NDArray[Any]) -> None:
    """Write a uint8 picture, (rows, columns) or (rows, columns, 3) in BGR, as a PNG file. InputError as `replacing`."""
    import cv2

    written, data = cv2.imencode(".png", picture)
    assert written
    with replacing(path) as file:
        file.write(data.tobytes())
