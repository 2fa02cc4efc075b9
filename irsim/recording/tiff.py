"""Pictures of a TIFF file, one page after the other."""

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

SUFFIXES = (".tif", ".tiff")
_LAYOUTS = {42: ("I", 4, "H", 12), 43: ("Q", 8, "Q", 20)}
"""By a file's version: how an offset is packed, where the first stands, how the number of a page's entries is packed,
and how long such an entry is, bytes (TIFF 6.0, section 2; BigTIFF, Aware Systems 2008)."""
_ORDERS = {b"II": "<", b"MM": ">"}
_WHOLE = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""How whole numbers of a TIFF are packed, by their type."""
_COLUMNS, _ROWS, _BITS, _PHOTOMETRIC, _SAMPLES, _FORMAT = 256, 257, 258, 262, 277, 339
_WHITE_IS_ZERO = 0
_OTHER_FORMATS = {2: "signed whole numbers", 3: "floating-point numbers", 5: "complex numbers", 6: "complex numbers"}
"""SampleFormat of what is no count; an undefined one (4) is to be read as unsigned (TIFF 6.0, section 19)."""
_TOGETHER_BYTES = 1 << 26
"""How much is decoded together, at least a page: to find one, all before it are passed over."""


def page_sizes(file: Path) -> tuple[int, ...]:
    """Bytes of each page of a TIFF file, decoded. InputError where it is none; where its chain of pages breaks off, for
    it is cut short then, which decoders pass over; and where OpenCV would make other counts of its pixels."""
    try:
        with file.open("rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
            found = list(_directories(data))
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except (KeyError, struct.error, ValueError, OverflowError):  # the last of an offset that no file reaches
        found = []
    if not found:
        raise _damaged(str(file))
    return tuple(_size(tags, f"{file}: page {page}") for page, tags in enumerate(found))


def _size(tags: dict[int, int], place: str) -> int:
    """Bytes of a page with those tags; InputError where its pixels are not read as they are."""
    bits, samples = tags.get(_BITS, 1), tags.get(_SAMPLES, 1)
    if what := _OTHER_FORMATS.get(tags.get(_FORMAT, 1)):
        raise InputError(f"{place} has {what} (SampleFormat); allowed: unsigned whole numbers of 8 or 16 bit")
    if bits not in (8, 16) or samples == 2:
        what = f"{counted(samples, 'sample')} of {counted(bits, 'bit')} a pixel"
        raise InputError(f"{place} has {what}; allowed: 8 or 16 bit, grey or colours")
    if tags.get(_PHOTOMETRIC) == _WHITE_IS_ZERO:
        raise InputError(f"{place}: 0 is white in it (PhotometricInterpretation); allowed: 0 is black")
    return tags.get(_COLUMNS, 0) * tags.get(_ROWS, 0) * samples * bits // 8


def _directories(data: mmap.mmap) -> Iterator[dict[int, int]]:
    """Of each page, from the first to the last, its tags that are whole numbers, the first number of each; ValueError
    where pages go in a circle."""
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
            if kind in _WHOLE:
                place = entry + 4 + inline
                if count * struct.calcsize(_WHOLE[kind]) > inline:
                    (place,) = struct.unpack_from(order + offset, data, place)
                (tags[tag],) = struct.unpack_from(order + _WHOLE[kind], data, place)
        yield tags
        (at,) = struct.unpack_from(order + offset, data, end)


def read_pages(file: Path, sizes: Sequence[int]) -> Iterator[Any]:
    """The pages, of `page_sizes`, as they stand, each (rows, columns) or (rows, columns, channels), turned as their
    Orientation says. InputError where one is damaged; TIFF has no checksums, so that only what cannot be decoded is
    known to be."""
    for wanted in _together(sizes):
        with _silent():
            try:
                found = cv2.imreadmulti(str(file), wanted.start, len(wanted), flags=cv2.IMREAD_UNCHANGED)[1]
            except cv2.error:  # a size that no picture has
                found = ()
        yield from found
        if len(found) < len(wanted):
            raise _damaged(str(file) if len(sizes) == 1 else f"{file}: page {wanted.start + len(found)}")
        del found  # before the next ones are decoded beside them


def _together(sizes: Sequence[int]) -> Iterator[range]:
    """Numbers of the pages that are decoded together."""
    first, held = 0, 0
    for page, size in enumerate(sizes):
        if page > first and held + size > _TOGETHER_BYTES:
            yield range(first, page)
            first, held = page, 0
        held += size
    yield range(first, len(sizes))


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
