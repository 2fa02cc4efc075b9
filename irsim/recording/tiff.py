"""TIFF files, with pages found by their tags (TIFF 6.0; BigTIFF, Aware Systems 2008) and decoded by OpenCV.

Tags are read first, as OpenCV converts some pixels to other counts and does not report a broken chain of pages.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
from cv2.utils import logging

from irsim.errors import InputError, counted

TIFF_SUFFIXES = (".tif", ".tiff")
_LAYOUTS = {42: ("I", 4, "H", 12), 43: ("Q", 8, "Q", 20)}
"""Layout for each version of the format: format of an offset, position of the first offset, format of a page's number
of entries, and bytes of an entry."""
_ORDERS = {b"II": "<", b"MM": ">"}
_INTEGERS = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""Format of whole numbers for each TIFF type."""
_COLUMNS, _ROWS, _BITS, _PHOTOMETRIC, _SAMPLES, _FORMAT = 256, 257, 258, 262, 277, 339
_WHITE_IS_ZERO = 0
_OTHER_FORMATS = {2: "signed whole numbers", 3: "floating-point numbers", 5: "complex numbers", 6: "complex numbers"}
"""Names of SampleFormats other than unsigned. An undefined format (4) is read as unsigned (TIFF 6.0, section 19)."""
_GROUP_BYTES = 1 << 26
"""Bytes of pages that are decoded in one call (at least one page). Each call skips through all earlier pages."""


def page_sizes(file: Path) -> tuple[int, ...]:
    """Return the size of each decoded page, bytes.

    Raises InputError for a file that is not TIFF, a broken chain of pages, and pixels that OpenCV would convert.
    """
    try:
        with file.open("rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
            found = list(_directories(data))
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except (KeyError, struct.error, ValueError, OverflowError):  # OverflowError: of an offset above 2^63
        found = []
    if not found:
        raise _damaged(str(file))
    return tuple(_size(tags, f"{file}: page {page}") for page, tags in enumerate(found))


def _size(tags: dict[int, int], place: str) -> int:
    """Return the size of a page from its tags, bytes. Raises InputError where OpenCV would convert its pixels."""
    bits, samples = tags.get(_BITS, 1), tags.get(_SAMPLES, 1)
    if format_name := _OTHER_FORMATS.get(tags.get(_FORMAT, 1)):
        raise InputError(f"{place} has {format_name} (SampleFormat); allowed: unsigned whole numbers of 8 or 16 bit")
    if bits not in (8, 16) or samples == 2:
        pixel = f"{counted(samples, 'sample')} of {counted(bits, 'bit')} a pixel"
        raise InputError(f"{place} has {pixel}; allowed: 8 or 16 bit, grey or colours")
    if tags.get(_PHOTOMETRIC) == _WHITE_IS_ZERO:
        raise InputError(f"{place}: 0 is white in it (PhotometricInterpretation); allowed: 0 is black")
    return tags.get(_COLUMNS, 0) * tags.get(_ROWS, 0) * samples * bits // 8


def _directories(data: mmap.mmap) -> Iterator[dict[int, int]]:
    """Yield the first number of each whole-number tag, by page. Raises ValueError for a circular chain of pages."""
    order = _ORDERS[data[:2]]
    offset, first, number, length = _LAYOUTS[struct.unpack_from(order + "H", data, 2)[0]]
    inline = struct.calcsize(order + offset)
    seen: set[int] = set()
    (at,) = struct.unpack_from(order + offset, data, first)
    while at:
        if at in seen:
            raise ValueError("a circle")
        seen.add(at)
        (entries,) = struct.unpack_from(order + number, data, at)
        start = at + struct.calcsize(order + number)
        end = start + length * entries
        tags = {}
        for entry in range(start, end, length):
            tag, kind, count = struct.unpack_from(order + "HH" + offset, data, entry)
            if kind in _INTEGERS:
                place = entry + 4 + inline
                if count * struct.calcsize(_INTEGERS[kind]) > inline:
                    (place,) = struct.unpack_from(order + offset, data, place)
                (tags[tag],) = struct.unpack_from(order + _INTEGERS[kind], data, place)
        yield tags
        (at,) = struct.unpack_from(order + offset, data, end)


def read_pages(file: Path, sizes: Sequence[int]) -> Iterator[Any]:
    """Yield the pages, (rows, columns) or (rows, columns, channels). Raises InputError where one cannot be decoded.

    sizes  sizes of the pages, as returned by `page_sizes`
    """
    for wanted in _page_groups(sizes):
        with _silenced():
            try:
                found = cv2.imreadmulti(str(file), wanted.start, len(wanted), flags=cv2.IMREAD_UNCHANGED)[1]
            except cv2.error:  # of an impossible size
                found = ()
        yield from found
        if len(found) < len(wanted):
            raise _damaged(str(file) if len(sizes) == 1 else f"{file}: page {wanted.start + len(found)}")
        del found  # frees the memory before the next group is decoded


def _page_groups(sizes: Sequence[int]) -> Iterator[range]:
    """Yield groups of page numbers, each decoded in one call."""
    first, held = 0, 0
    for page, size in enumerate(sizes):
        if page > first and held + size > _GROUP_BYTES:
            yield range(first, page)
            first, held = page, 0
        held += size
    yield range(first, len(sizes))


def _damaged(place: str) -> InputError:
    return InputError(f"{place}: is not a TIFF picture, or is cut short or damaged")


@contextmanager
def _silenced() -> Iterator[None]:
    """Suppress the messages of OpenCV on standard error in the block."""
    level = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(level)
