"""Pictures from a folder, a TIFF file, an array or a video, one after the other, in grey."""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np

from irsim.config.paths import check_input
from irsim.errors import InputError
from irsim.recording import arrays
from irsim.recording.tiff import SUFFIXES, page_sizes, read_pages
from irsim.types import Image

ALLOWED = "a folder of PNG or TIFF (8 or 16 bit), a TIFF of several pages, a .npy or .npz of such counts, or a video"
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_CODEC_ROUNDS = 4
"""Greys that the channels of a grey picture may lie apart after a video codec: its two colour differences rounded one
step off grey turn red by 255/224 * 1.402 = 1.6 greys and blue by 255/224 * 1.772 = 2.0 the other way (ITU-R BT.601)."""

_END_AT_LEAST = 12  # bytes of a PNG chunk around its data: length, type, CRC


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture (rows, columns) uint8 or uint16, where it comes from, and whether it had colours."""

    image: Image
    place: str
    had_colours: bool


class Pictures(Protocol):
    """Where pictures come from. count is None where only reading them all tells; rate_hz where nothing
    states it."""

    @property
    def count(self) -> int | None: ...
    @property
    def rate_hz(self) -> float | None: ...
    def __iter__(self) -> Iterator[Picture]: ...


def open_pictures(path: Path) -> Pictures:
    """The pictures of a folder, a TIFF, an array or a video. InputError where it is none of these or holds none."""
    if path.is_dir():
        return _folder(path)
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder")
    suffix = path.suffix.lower()
    if suffix == ".png" or (suffix in SUFFIXES and len(sizes := page_sizes(path)) == 1):
        raise InputError(f"{path}: is one picture; allowed: the folder that holds the pictures, or {ALLOWED}")
    if suffix in arrays.SUFFIXES:
        return Stack(path, arrays.read_stack(path))
    return Pages(path, sizes) if suffix in SUFFIXES else Video(path)


def _folder(path: Path) -> Folder:
    """Its pictures: files of one kind, for a preview or a mask beside each would be taken for a frame."""
    kinds = ((".png",), SUFFIXES)
    found = [[file for file in path.iterdir() if file.suffix.lower() in kind] for kind in kinds]
    if all(found):
        raise InputError(f"{path}: holds .png and .tif; allowed: pictures of one kind in a folder")
    if not any(found):
        raise InputError(f"{path}: holds no .png or .tif; allowed: {ALLOWED}")
    return Folder(tuple(sorted(found[0] or found[1], key=_natural)))


def _natural(file: Path) -> list[tuple[int, int, str]]:
    """Sort key by which frame_2 comes before frame_10."""
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
            yield _grey(_read_tiff(file) if file.suffix.lower() in SUFFIXES else _read_png(file), str(file))


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
    except cv2.error:  # a size that no picture has
        image = None
    if image is None:
        raise InputError(f"{file}: is not a PNG picture, or is cut short or damaged")
    return image


def _is_whole_png(data: bytes) -> bool:
    """Do all chunks match their CRCs, up to the last? (PNG specification, 5.3.) Decoders differ in what
    they make of broken files."""
    if not data.startswith(_PNG_MAGIC):
        return False
    position = len(_PNG_MAGIC)
    while len(data) - position >= _END_AT_LEAST:
        length = int.from_bytes(data[position : position + 4], "big")
        end = position + 8 + length
        if zlib.crc32(data[position + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            return False
        if data[position + 4 : position + 8] == b"IEND":
            return True
        position = end + 4
    return False


class Video:
    """A video that OpenCV can decode; always 8 bit."""

    count = None

    def __init__(self, path: Path) -> None:
        self._path = path
        capture = self._open()
        rate = capture.get(cv2.CAP_PROP_FPS)
        self.rate_hz = float(rate) if np.isfinite(rate) and rate > 0 else None
        stated = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self.stated_count = int(stated) if np.isfinite(stated) and stated > 0 else None
        """What the container says; only decoding tells."""
        capture.release()

    def _open(self) -> cv2.VideoCapture:
        # FFmpeg speaks on standard error of what is said here in one line.
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
                yield _grey(image, f"{self._path}: frame {index}", _CODEC_ROUNDS)
                index += 1
        finally:
            capture.release()
        if index == 0:
            raise InputError(f"{self._path}: no frame of this video can be decoded")


def _grey(image: Any, place: str, rounded: int = 0) -> Picture:
    """Grey from grey or colour; channels that lie at most `rounded` greys apart are grey that was stored as colour."""
    if image.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{place}: has pixels of type {image.dtype}; allowed: unsigned, 8 or 16 bit")
    if image.ndim == 2:
        return Picture(image, place, False)
    colours = image[..., :3]
    if (colours == colours[..., :1]).all():
        return Picture(np.ascontiguousarray(colours[..., 0]), place, False)
    grey: Any = cv2.cvtColor(np.ascontiguousarray(colours), cv2.COLOR_BGR2GRAY)
    return Picture(grey, place, bool((colours.max(axis=-1) - colours.min(axis=-1) > rounded).any()))
