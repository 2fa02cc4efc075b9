"""Grey images of other programs: a folder of PNG or TIFF, a TIFF of several pages, a numpy array or a video."""

from __future__ import annotations

import mmap
import os
import re
import reprlib
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
from cv2.utils import logging

from irsim.config.paths import check_input
from irsim.errors import InputError, counted
from irsim.types import Image

TIFF_SUFFIXES = (".tif", ".tiff")
_LAYOUTS = {42: ("I", 4, "H", 12), 43: ("Q", 8, "Q", 20)}
"""By a file's version: format of an offset, position of the first one, format of the number of a page's entries, bytes
of an entry (TIFF 6.0, section 2; BigTIFF, Aware Systems 2008)."""
_ORDERS = {b"II": "<", b"MM": ">"}
_INTEGERS = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""Formats of whole numbers of a TIFF, by their type."""
_COLUMNS, _ROWS, _BITS, _PHOTOMETRIC, _SAMPLES, _FORMAT = 256, 257, 258, 262, 277, 339
_WHITE_IS_ZERO = 0
_OTHER_FORMATS = {2: "signed whole numbers", 3: "floating-point numbers", 5: "complex numbers", 6: "complex numbers"}
"""Names of SampleFormats other than unsigned; undefined (4) is read as unsigned (TIFF 6.0, section 19)."""
_GROUP_BYTES = 1 << 26
"""Bytes of pages decoded in one call, at least one page: OpenCV skips through all pages before the first."""


def page_sizes(file: Path) -> tuple[int, ...]:
    """Return the decoded bytes of each page of a TIFF file.

    InputError where it is not TIFF; where its chain of pages breaks off, which decoders do not report; and where OpenCV
    would convert its pixels to other counts.
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
    """Return the bytes of a page with these tags; InputError where its pixels would be converted."""
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
    """Yield the tags of each page that are whole numbers, the first number of each; ValueError where the chain of pages
    is a circle."""
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
    """Yield the pages, each (rows, columns) or (rows, columns, channels), rotated by their Orientation.

    sizes  of `page_sizes`

    InputError where a page cannot be decoded; TIFF has no checksums that would show other damage.
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
    """Yield the page numbers of each group that is decoded in one call."""
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
    """Suppress messages of OpenCV on standard error in the block; errors are raised as InputError instead."""
    level = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(level)


ARRAY_SUFFIXES = (".npy", ".npz")
_PIXELS = (np.dtype(np.uint8), np.dtype(np.uint16))


def read_stack(file: Path) -> Image:
    """Return (frames, rows, columns) uint8 or uint16, in the byte order of the file.

    A .npy is memory-mapped; a .npz must hold one array, which is read whole. InputError for anything else.
    """
    try:
        found = np.load(file, mmap_mode="r", allow_pickle=False)
        if isinstance(found, np.lib.npyio.NpzFile):
            with found as archive:
                found = archive[_only(file, archive)]
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or 'is cut short or damaged'}") from None
    except MemoryError:  # of a whole .npz, or of a damaged header
        raise InputError(f"{file}: does not fit in memory, or is damaged") from None
    except Exception:  # numpy documents no errors for damaged headers and archives
        found = None
    if not isinstance(found, np.ndarray):
        raise InputError(f"{file}: is not an array of numbers saved by numpy, or is cut short or damaged")
    return _checked(file, found)


def _only(file: Path, archive: Any) -> str:
    """Return the name of the only array of an archive; other files may be in it."""
    arrays = [entry.removesuffix(".npy") for entry in archive.zip.namelist() if entry.endswith(".npy")]
    if len(arrays) != 1:
        raise InputError(
            f"{file}: holds the arrays {reprlib.repr(arrays)}; allowed: one (numpy.save writes a single one)"
        )
    return str(arrays[0])


def _checked(file: Path, found: Any) -> Image:
    if found.ndim != 3 or 0 in found.shape:
        shape = " x ".join(map(str, found.shape)) or "a single number"
        raise InputError(f"{file}: is an array of {shape}; allowed: frames x rows x columns")
    if found.dtype.newbyteorder("=") not in _PIXELS:
        raise InputError(f"{file}: has pixels of type {found.dtype}; allowed: unsigned, 8 or 16 bit")
    stack: Image = found
    return stack


ALLOWED = "a folder of PNG or TIFF (8 or 16 bit), a TIFF of several pages, a .npy or .npz of such counts, or a video"
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_CODEC_ROUNDING = 4
"""Largest difference between the channels of a grey picture after a video codec, greys: colour differences one step off
by rounding change red by 255/224 * 1.402 = 1.6 and blue by 255/224 * 1.772 = 2.0 the other way (ITU-R BT.601)."""

_CHUNK_OVERHEAD = 12  # bytes of a PNG chunk around its data: length, type, CRC


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Picture (rows, columns) uint8 or uint16, its origin for messages, and whether it had colours."""

    image: Image
    place: str
    had_colours: bool


class Pictures(Protocol):
    """Iterable of pictures. count is None where it is known only after reading them all, rate_hz where unknown."""

    @property
    def count(self) -> int | None: ...
    @property
    def rate_hz(self) -> float | None: ...
    def __iter__(self) -> Iterator[Picture]: ...


def open_pictures(path: Path) -> Pictures:
    """Open a folder, a TIFF, an array or a video. InputError for another file, or where there are no pictures in it."""
    if path.is_dir():
        return _folder(path)
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder")
    suffix = path.suffix.lower()
    if suffix == ".png" or (suffix in TIFF_SUFFIXES and len(sizes := page_sizes(path)) == 1):
        raise InputError(f"{path}: is one picture; allowed: the folder that holds the pictures, or {ALLOWED}")
    if suffix in ARRAY_SUFFIXES:
        return Stack(path, read_stack(path))
    return Pages(path, sizes) if suffix in TIFF_SUFFIXES else Video(path)


def _folder(path: Path) -> Folder:
    """Return the pictures of a folder. InputError for files of two kinds: one may be previews or masks."""
    kinds = ((".png",), TIFF_SUFFIXES)
    found = [[file for file in path.iterdir() if file.suffix.lower() in kind] for kind in kinds]
    if all(found):
        raise InputError(f"{path}: holds .png and .tif; allowed: pictures of one kind in a folder")
    if not any(found):
        raise InputError(f"{path}: holds no .png or .tif; allowed: {ALLOWED}")
    return Folder(tuple(sorted(found[0] or found[1], key=_natural)))


def _natural(file: Path) -> list[tuple[int, int, str]]:
    """Return a sort key that puts frame_2 before frame_10."""
    parts = re.split(r"(\d+)", file.name)
    return [(1, int(part), part) if part.isdigit() else (0, 0, part) for part in parts]


@dataclass(frozen=True)
class Folder:
    """Files of one picture each, in order."""

    files: tuple[Path, ...]
    rate_hz: None = None

    @property
    def count(self) -> int:
        return len(self.files)

    def __iter__(self) -> Iterator[Picture]:
        for file in self.files:
            check_input(file, "a picture")
            yield _grey(_read_tiff(file) if file.suffix.lower() in TIFF_SUFFIXES else _read_png(file), str(file))


@dataclass(frozen=True)
class Pages:
    """The pages of a TIFF file in order.

    sizes   of each page, bytes
    """

    file: Path
    sizes: tuple[int, ...]
    rate_hz: None = None

    @property
    def count(self) -> int:
        return len(self.sizes)

    def __iter__(self) -> Iterator[Picture]:
        for page, image in enumerate(read_pages(self.file, self.sizes)):
            yield _grey(image, f"{self.file}: page {page}")


@dataclass(frozen=True, eq=False)
class Stack:
    """The frames of an array.

    frames   (frames, rows, columns) uint8 or uint16, of any byte order
    """

    file: Path
    frames: Image
    rate_hz: None = None

    @property
    def count(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[Picture]:
        native: Any = self.frames.dtype.newbyteorder("=")
        for index, image in enumerate(self.frames):
            yield Picture(np.ascontiguousarray(image, native), f"{self.file}: frame {index}", False)


def _read_tiff(file: Path) -> Any:
    if len(sizes := page_sizes(file)) > 1:
        raise InputError(
            f"{file}: holds {len(sizes)} pictures; allowed: one in each file of a folder, or such a file alone"
        )
    return next(read_pages(file, sizes))


def _read_png(file: Path) -> Any:
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if _is_whole_png(data) else None
    except cv2.error:  # of an impossible size
        image = None
    if image is None:
        raise InputError(f"{file}: is not a PNG picture, or is cut short or damaged")
    return image


def _is_whole_png(data: bytes) -> bool:
    """Return whether all chunks match their CRCs, up to the last (PNG specification, 5.3). Decoders differ in how they
    treat damaged files."""
    if not data.startswith(_PNG_MAGIC):
        return False
    position = len(_PNG_MAGIC)
    while len(data) - position >= _CHUNK_OVERHEAD:
        length = int.from_bytes(data[position : position + 4], "big")
        end = position + 8 + length
        if zlib.crc32(data[position + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            return False
        if data[position + 4 : position + 8] == b"IEND":
            return True
        position = end + 4
    return False


class Video:
    """Video that OpenCV can decode; always 8 bit."""

    count = None

    def __init__(self, path: Path) -> None:
        self._path = path
        capture = self._open()
        rate = capture.get(cv2.CAP_PROP_FPS)
        self.rate_hz = float(rate) if np.isfinite(rate) and rate > 0 else None
        stated = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self.container_count = int(stated) if np.isfinite(stated) and stated > 0 else None
        """Number of frames by the container, which decoding may not confirm."""
        capture.release()

    def _open(self) -> cv2.VideoCapture:
        # Suppresses messages of FFmpeg on standard error; errors are raised as InputError instead.
        os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
        capture = cv2.VideoCapture(str(self._path))
        if not capture.isOpened():
            raise InputError(f"{self._path}: cannot be opened as a video; allowed: {ALLOWED}")
        return capture

    def __iter__(self) -> Iterator[Picture]:
        capture = self._open()
        try:
            index = 0
            while True:
                there, image = capture.read()
                if not there:
                    break
                yield _grey(image, f"{self._path}: frame {index}", _CODEC_ROUNDING)
                index += 1
        finally:
            capture.release()
        if index == 0:
            raise InputError(f"{self._path}: no frame of this video can be decoded")


def _grey(image: Any, place: str, rounding: int = 0) -> Picture:
    """Return a grey picture; channels that differ by at most `rounding` greys are grey that was stored as colour."""
    if image.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{place}: has pixels of type {image.dtype}; allowed: unsigned, 8 or 16 bit")
    if image.ndim == 2:
        return Picture(image, place, False)
    colours = image[..., :3]
    if (colours == colours[..., :1]).all():
        return Picture(np.ascontiguousarray(colours[..., 0]), place, False)
    grey: Any = cv2.cvtColor(np.ascontiguousarray(colours), cv2.COLOR_BGR2GRAY)
    return Picture(grey, place, bool((colours.max(axis=-1) - colours.min(axis=-1) > rounding).any()))
