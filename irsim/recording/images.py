"""Grey images of other programs: a folder of PNG, TIFF or JPEG, a TIFF of several pages, a numpy array or a video."""

from __future__ import annotations

import os
import re
import reprlib
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from irsim.config.paths import check_input
from irsim.errors import InputError
from irsim.recording.tiff import TIFF_SUFFIXES, page_sizes, read_pages
from irsim.types import Image

ALLOWED = (
    "a folder of PNG or TIFF (8 or 16 bit) or JPEG, a TIFF of several pages, a .npy or .npz of such counts, a video, "
    "a ROS 2 bag, an MCAP file, or a raw file with its layout"
)
_PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_JPEG_MAGIC, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
JPEG_SUFFIXES = (".jpg", ".jpeg")
_KINDS = ((".png",), TIFF_SUFFIXES, JPEG_SUFFIXES)
"""Endings of each kind of picture in a folder."""
CODEC_ROUNDING = 4
"""Largest difference between the channels of a grey picture after a video codec, grey levels: colour differences one
step too large change red by 255/224 * 1.402 = 1.6 and blue by 255/224 * 1.772 = 2.0 (ITU-R BT.601)."""

_CHUNK_OVERHEAD = 12  # bytes of a PNG chunk around its data: length, type, CRC
ARRAY_SUFFIXES = (".npy", ".npz")
_PIXELS = (np.dtype(np.uint8), np.dtype(np.uint16))


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Picture (rows, columns) of uint8 or uint16, its file and page or frame, and True if it had colours.

    time  s after the first picture; None: of a constant frame rate
    `colour_range` is the largest difference between the channels of a pixel.
    """

    image: Image
    place: str
    had_colours: bool
    time: float | None = None
    colour_range: int = 0


@dataclass(frozen=True, eq=False)
class Pictures:
    """Pictures of a folder or a file.

    read      function that yields the pictures in order
    count     number of pictures; None for a video
    rate_hz   frame rate of a video that states one, or of messages by their times, Hz
    stated    number of frames that a video states, which may be wrong
    files     files of a folder, in order
    notes     on the frame rate
    """

    read: Callable[[], Iterator[Picture]]
    count: int | None = None
    rate_hz: float | None = None
    stated: int | None = None
    files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def is_video(self) -> bool:
        return self.count is None


def open_pictures(path: Path) -> Pictures:
    """Open a folder, a TIFF, an array or a video. Raises InputError for another file, or one without pictures."""
    if path.is_dir():
        files = _folder_files(path)
        return Pictures(partial(_read_files, files), len(files), files=tuple(files))
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder")
    suffix = path.suffix.lower()
    if suffix in (".png", *JPEG_SUFFIXES) or (suffix in TIFF_SUFFIXES and len(sizes := page_sizes(path)) == 1):
        raise InputError(f"{path}: is one picture; allowed: the folder that holds the pictures, or {ALLOWED}")
    if suffix in ARRAY_SUFFIXES:
        stack = read_stack(path)
        return Pictures(partial(_read_frames, path, stack), len(stack))
    if suffix in TIFF_SUFFIXES:
        return Pictures(partial(_read_tiff_pages, path, sizes), len(sizes))
    return _video(path)


def _folder_files(path: Path) -> list[Path]:
    """Return the picture files of a folder in natural order. InputError for two formats, as one may be masks."""
    found = {kind[0]: [file for file in path.iterdir() if file.suffix.lower() in kind] for kind in _KINDS}
    kinds = [ending for ending, files in found.items() if files]
    if len(kinds) > 1:
        raise InputError(f"{path}: holds {' and '.join(kinds)}; allowed: pictures of one kind in a folder")
    if not kinds:
        raise InputError(f"{path}: holds no .png, .tif or .jpg; allowed: {ALLOWED}")
    return sorted(found[kinds[0]], key=_natural)


def _natural(file: Path) -> list[tuple[int, int, str]]:
    """Return a sort key for natural order, in which frame_2 precedes frame_10."""
    parts = re.split(r"(\d+)", file.name)
    return [(1, int(part), part) if part.isdigit() else (0, 0, part) for part in parts]


def _read_files(files: list[Path]) -> Iterator[Picture]:
    for file in files:
        check_input(file, "a picture")
        ending = file.suffix.lower()
        if ending in JPEG_SUFFIXES:
            yield as_grey(_decoded_file(file, "JPEG"), str(file), CODEC_ROUNDING)
        else:
            read = _read_tiff(file) if ending in TIFF_SUFFIXES else _decoded_file(file, "PNG")
            yield as_grey(read, str(file))


def _read_tiff_pages(file: Path, sizes: tuple[int, ...]) -> Iterator[Picture]:
    for page, image in enumerate(read_pages(file, sizes)):
        yield as_grey(image, f"{file}: page {page}")


def _read_frames(file: Path, stack: Image) -> Iterator[Picture]:
    native: Any = stack.dtype.newbyteorder("=")
    for index, image in enumerate(stack):
        if index and isinstance(stack, np.memmap) and stack.flags.c_contiguous:
            # Mapped anew for each frame: earlier pages, which count as memory of this process, are given up.
            image = np.memmap(file, stack.dtype, "r", stack.offset + index * image.nbytes, image.shape)
        yield Picture(np.array(image, native, order="C"), f"{file}: frame {index}", False)


def _video(path: Path) -> Pictures:
    capture = _capture(path)
    rate, stated = (capture.get(key) for key in (cv2.CAP_PROP_FPS, cv2.CAP_PROP_FRAME_COUNT))
    capture.release()
    return Pictures(
        partial(_read_video, path),
        rate_hz=float(rate) if np.isfinite(rate) and rate > 0 else None,
        stated=int(stated) if np.isfinite(stated) and stated > 0 else None,
    )


def _capture(path: Path) -> cv2.VideoCapture:
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # no messages of FFmpeg on standard error
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise InputError(f"{path}: cannot be opened as a video; allowed: {ALLOWED}")
    return capture


def _read_video(path: Path) -> Iterator[Picture]:
    capture = _capture(path)
    index = 0
    try:
        while (decoded := capture.read())[0]:
            yield as_grey(decoded[1], f"{path}: frame {index}", CODEC_ROUNDING)
            index += 1
    finally:
        capture.release()
    if index == 0:
        raise InputError(f"{path}: no frame of this video can be decoded")


def read_stack(file: Path) -> Image:
    """Return frames (T, rows, columns), uint8 or uint16 in the byte order of the file. InputError for other files.

    A .npy file is memory-mapped. A .npz file contains one array, which is read completely.
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
    except MemoryError:  # from a large .npz, or from a damaged header
        raise InputError(f"{file}: does not fit in memory, or is damaged") from None
    except Exception:  # numpy documents no errors for damaged headers and archives
        found = None
    if not isinstance(found, np.ndarray):
        raise InputError(f"{file}: is not an array of numbers saved by numpy, or is cut short or damaged")
    return _checked(file, found)


_LARGE_ARRAY = 1 << 28
"""Size from which an array must not be much larger than its file, bytes."""
_MOST_PACKED = 100
"""Largest ratio of a large array's size to its packed size; pictures with noise reach 10."""


def _only(file: Path, archive: Any) -> str:
    """Return the name of the only array in a .npz archive, which may contain other files."""
    arrays = [entry.removesuffix(".npy") for entry in archive.zip.namelist() if entry.endswith(".npy")]
    if len(arrays) != 1:
        raise InputError(
            f"{file}: holds the arrays {reprlib.repr(arrays)}; allowed: one (numpy.save writes a single one)"
        )
    entry = archive.zip.getinfo(f"{arrays[0]}.npy")
    if entry.file_size > _LARGE_ARRAY and entry.file_size > _MOST_PACKED * entry.compress_size:
        ratio = entry.file_size // max(entry.compress_size, 1)
        raise InputError(f"{file}: unpacks to {entry.file_size >> 20} MB, {ratio} times its size; allowed: a .npy file")
    return str(arrays[0])


def _checked(file: Path, found: Any) -> Image:
    if found.ndim != 3 or 0 in found.shape:
        shape = " x ".join(map(str, found.shape)) or "a single number"
        raise InputError(f"{file}: is an array of {shape}; allowed: frames x rows x columns")
    if found.dtype.newbyteorder("=") not in _PIXELS:
        raise InputError(f"{file}: has pixels of type {found.dtype}; allowed: unsigned, 8 or 16 bit")
    stack: Image = found
    return stack


def _read_tiff(file: Path) -> Any:
    if len(sizes := page_sizes(file)) > 1:
        raise InputError(
            f"{file}: holds {len(sizes)} pictures; allowed: one in each file of a folder, or such a file alone"
        )
    return next(read_pages(file, sizes))


def _decoded_file(file: Path, kind: str) -> Any:
    """Return the pixels of a PNG or JPEG file that is whole."""
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    return decoded(data, str(file), kind)


def decoded(data: bytes, place: str, kind: str) -> Any:
    """Return the pixels of PNG or JPEG data that is whole; InputError, with the place, for other data."""
    is_whole = _is_whole_png if kind == "PNG" else _is_whole_jpeg
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if is_whole(data) else None
    except cv2.error:  # of an impossible size
        image = None
    if image is None:
        raise InputError(f"{place}: is not a {kind} picture, or is cut short or damaged")
    return image


def _is_whole_jpeg(data: bytes) -> bool:
    """Return True where JPEG data has its begin and its end (ITU-T T.81, B.1.1.3); OpenCV fills in lost rows."""
    return data.startswith(_JPEG_MAGIC) and data.rstrip(b"\0").endswith(_JPEG_END)


def _is_whole_png(data: bytes) -> bool:
    """Return True where all PNG chunks up to the last match their CRCs (PNG specification, 5.3). Decoders do not all
    check this."""
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


def as_grey(image: Any, place: str, rounding: int = 0, time: float | None = None) -> Picture:
    """Return an image as a grey picture. Channels that differ by at most `rounding` grey levels are not colours."""
    if image.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{place}: has pixels of type {image.dtype}; allowed: unsigned, 8 or 16 bit")
    if image.ndim == 2:
        return Picture(image, place, False, time)
    colours = image[..., :3]
    if (colours == colours[..., :1]).all():
        return Picture(np.ascontiguousarray(colours[..., 0]), place, False, time)
    grey: Any = cv2.cvtColor(np.ascontiguousarray(colours), cv2.COLOR_BGR2GRAY)
    largest = int((colours.max(axis=-1) - colours.min(axis=-1)).max())
    return Picture(grey, place, largest > rounding, time, largest)
