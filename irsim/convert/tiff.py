"""Pictures of a TIFF file, one page after the other."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
from cv2.utils import logging

from irsim.errors import InputError

SUFFIXES = (".tif", ".tiff")
_LAYOUTS = {42: ("I", 4, "H", 12), 43: ("Q", 8, "Q", 20)}
"""By a file's version: how an offset is packed, where the first stands, how the number of a page's entries is packed,
and how long such an entry is, bytes (TIFF 6.0, section 2; BigTIFF, Aware Systems 2008)."""
_ORDERS = {b"II": "<", b"MM": ">"}


def pages(file: Path) -> int:
    """How many pages a TIFF file has. InputError where it is none, or their chain breaks off: it is cut short then,
    which decoders pass over."""
    try:
        with file.open("rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
            count = _chained(data)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except (KeyError, struct.error, ValueError):
        count = 0
    if not count:
        raise _damaged(str(file))
    return count


def _chained(data: mmap.mmap) -> int:
    """How many pages there are from the first to the last; 0 where they go in a circle."""
    order = _ORDERS[data[:2]]
    offset, first, number, entry = _LAYOUTS[struct.unpack_from(order + "H", data, 2)[0]]
    seen: set[int] = set()
    (at,) = struct.unpack_from(order + offset, data, first)
    while at:
        if at in seen:
            return 0
        seen.add(at)
        (entries,) = struct.unpack_from(order + number, data, at)
        (at,) = struct.unpack_from(order + offset, data, at + struct.calcsize(order + number) + entry * entries)
    return len(seen)


def read_page(file: Path, page: int, place: str) -> Any:
    """One page as it stands, (rows, columns) or (rows, columns, channels). InputError at `place` where it is damaged;
    TIFF has no checksums, so that only what cannot be decoded is known to be."""
    with _silent():
        try:
            there, found = cv2.imreadmulti(str(file), page, 1, flags=cv2.IMREAD_UNCHANGED)
        except cv2.error:  # a size that no picture has
            there, found = False, ()
    if not there or not found:
        raise _damaged(place)
    return found[0]


def _damaged(place: str) -> InputError:
    return InputError(f"{place}: is not a TIFF picture, or is cut short or damaged")


@contextmanager
def _silent() -> Iterator[None]:
    """OpenCV speaks on standard error of what is said here in one line."""
    level = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(level)
