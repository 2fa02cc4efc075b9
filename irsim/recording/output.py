"""Output files and folders, which are checked before any work, and written completely or not at all."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import cv2
import numpy.typing as npt

from irsim.config.paths import check_input
from irsim.errors import InputError


def check_output(path: Path | None, *inputs: Path | None, endings: Sequence[str] = ()) -> None:
    """Raise InputError where `path` cannot become a file, would replace one of `inputs`, or has none of `endings`.

    inputs   files that the command reads (for a folder: every file in it), or its other outputs
    endings  allowed suffixes such as ".mcap"; () allows any

    A `path` of None is accepted.
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
    """Make a folder and its parents unless they exist. Raises InputError where that fails."""
    try:
        for place in (path, *path.parents):
            if place.exists() and not place.is_dir():
                which = "" if place == path else f"{place} "
                raise InputError(f"{path}: {which}is no folder; allowed: the name of a folder")
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: no folder can be made there: {error.strerror or error}") from None


def refuse_leftovers(folder: Path, stays: Callable[[str], bool], content: str) -> None:
    """Raise InputError where files of an earlier call in the output folder would mix with the new ones.

    stays   function of a file name: True for a file that contains `content` and is not replaced by this call
    """
    if left := _summary(folder, stays):
        raise InputError(
            f"{folder}: holds {content} of another call that would stay among the new ones, {left}; "
            "allowed: another folder, or the same without them"
        )


def refuse_others(folder: Path, other: Callable[[str], bool], content: str, command: str) -> None:
    """Raise InputError where an output folder contains files that this program did not write.

    other   function of a file name: True for such a file, which contains `content`
    """
    if there := _summary(folder, other):
        raise InputError(
            f"{folder}: holds {content}, {there}; allowed: a new or empty folder, or one that {command} wrote"
        )


def _summary(folder: Path, wanted: Callable[[str], bool]) -> str:
    """Return 'NAME and N more' for the files of a folder for which `wanted` is True, or ''."""
    try:
        names = sorted(path.name for path in folder.iterdir() if wanted(path.name)) if folder.is_dir() else []
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror or error}") from None
    return "".join(names[:1]) + (f" and {len(names) - 1} more" if len(names) > 1 else "")


@contextmanager
def atomic_file(path: Path, tidy: bool = False) -> Iterator[BinaryIO]:
    """Open a temporary file for a block. It becomes `path` if the block ends without an error, else it is removed.

    tidy   first remove temporary files of killed processes, for outputs that take long to write
    """
    check_output(path)
    real = path.resolve()  # the target of a symbolic link is replaced
    if tidy:
        _remove_leftovers(real)
    temporary = real.with_name(f".{real.name}.{os.getpid()}.tmp")
    try:
        temporary.unlink(missing_ok=True)  # left by an ended process, or a link, which would be followed
        with open(temporary, "xb") as file:
            _lock(file)
            yield file
        os.replace(temporary, real)
    except OSError as error:
        # A failed write (a full disk) names no file. Errors about other files are not reported here.
        if error.filename not in (None, str(temporary)):
            raise
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(OSError):  # a read-only file system refuses to remove even a missing file
            temporary.unlink(missing_ok=True)


@contextmanager
def all_or_none(*paths: Path | None) -> Iterator[None]:
    """Remove outputs that are new if the block, which writes them, ends with an error; None stands for no output."""
    new = [path for path in paths if path is not None and not path.exists()]
    try:
        yield
    except BaseException:
        for path in new:
            path.unlink(missing_ok=True)
        raise


@contextmanager
def atomic_text(path: Path) -> Iterator[TextIO]:
    """Open an `atomic_file` for UTF-8 text, with line ends unchanged."""
    with atomic_file(path) as file, io.TextIOWrapper(file, encoding="utf-8", newline="") as text:
        yield text


def write_png(path: Path, picture: npt.NDArray[Any]) -> None:
    """Write a uint8 picture, (rows, columns) or (rows, columns, 3) in BGR, as PNG. InputError as in `atomic_file`."""
    written, data = cv2.imencode(".png", picture)
    assert written
    with atomic_file(path) as file:
        file.write(data.tobytes())


def _remove_leftovers(real: Path) -> None:
    """Remove an output's temporary files that ended processes have left, unless another process has locked them."""
    pattern = re.compile(rf"\.{re.escape(real.name)}\.(\d+)\.tmp")
    with suppress(OSError):  # a folder that cannot be read, or a file that another process has removed
        for path in list(real.parent.iterdir()):
            found = pattern.fullmatch(path.name)
            if found is not None and not _is_alive(int(found[1])):
                with path.open("rb") as file:
                    if _lock(file):
                        path.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    """Return False where the process with this id has ended."""
    if sys.platform == "win32":  # os.kill would end the process
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def _lock(file: BinaryIO) -> bool:
    """Lock a file until it is closed; return False where another process, also on another machine, holds it."""
    if sys.platform != "win32":
        import fcntl

        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a file system without locks: the process id alone decides
            pass
    return True
