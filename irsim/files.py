"""Output files: checked before any work, whole or not there at all."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, TextIO

from irsim.errors import InputError


def check_output(path: Path | None) -> None:
    """InputError where `path` cannot become a file: its folder is missing, or it is a folder.

    None, an output that nobody asked for, passes.
    """
    if path is None:
        return
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; allowed: an existing folder")
    if path.is_dir():
        raise InputError(f"{path}: is a folder; allowed: the name of a file")


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write that takes its name when the block ends well and is gone when it does not."""
    check_output(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with open(temporary, "wb") as file:
            yield file
        os.replace(temporary, path)
    except OSError as error:
        # A failed write (a full disk) names no file; any other file's trouble is not ours to word.
        if error.filename not in (None, str(temporary)):
            raise
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def replacing_text(path: Path) -> Iterator[TextIO]:
    """The same for text: UTF-8, lines ended as they are written."""
    with replacing(path) as file, io.TextIOWrapper(file, encoding="utf-8", newline="") as text:
        yield text
