"""Folder of a data set: files that are written wholly or not at all, and their digest."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import cv2
import numpy.typing as npt

from irsim.errors import InputError
from irsim.recording.output import atomic_file, make_folder

PNG_LEVEL = 1
"""Compression level of zlib, 0 to 9. Higher levels write noise hardly smaller, and take a multiple of the time."""
_PNG_OPTIONS = [cv2.IMWRITE_PNG_COMPRESSION, PNG_LEVEL, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]
if hasattr(cv2, "IMWRITE_PNG_FILTER"):  # OpenCV 4.12 and later; one filter for all rows takes half the time
    _PNG_OPTIONS += [cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP]
JPEG_QUALITY = 95


class DatasetFolder:
    """Writer of files below a folder. Their names use slashes; folders are made as needed."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._digest = hashlib.blake2b(digest_size=16)
        self._made: set[Path] = set()

    @property
    def digest(self) -> str:
        """BLAKE2b digest of the names and contents of all files, in the order of writing."""
        return self._digest.hexdigest()

    def write(self, name: str, data: bytes) -> None:
        """Write a file. InputError where that fails, as on a full disk; no part of it stays."""
        path = self._place(name)
        try:
            path.write_bytes(data)
        except BaseException as error:
            with suppress(OSError):
                path.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
            raise
        self._digest.update(name.encode() + b"\0" + data)

    def text(self, name: str, text: str) -> None:
        """Write a text file in UTF-8."""
        self.write(name, text.encode())

    def picture(self, name: str, image: npt.NDArray[Any]) -> None:
        """Write a picture of one channel, uint8 or (PNG only) uint16; its ending says the format, .png or .jpg."""
        png = name.endswith(".png")
        options = _PNG_OPTIONS if png else [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
        done, data = cv2.imencode(".png" if png else ".jpg", image, options)
        assert done
        self.write(name, data.tobytes())

    @contextmanager
    def stream(self, name: str) -> Iterator[BinaryIO]:
        """Open a file for a block. It appears at its place after the block, if that ends without an error."""
        path = self._place(name)
        with atomic_file(path) as file:
            yield file
        self.add_digest(name)

    @contextmanager
    def foreign(self, name: str) -> Iterator[Path]:
        """Yield a path at which another library writes a file or a folder, and which becomes `name` after the block."""
        path = self._place(name)
        temporary = path.with_name(f".{path.name}.tmp")
        make_folder(temporary)
        try:
            yield temporary / path.name
            (temporary / path.name).replace(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
        for file in sorted(each for each in path.rglob("*") if each.is_file()) if path.is_dir() else [path]:
            self.add_digest(file.relative_to(self.root).as_posix())

    def add_digest(self, name: str) -> None:
        """Take a file that is written already into the digest."""
        with open(self.root / name, "rb") as file:
            self._digest.update(name.encode() + b"\0" + hashlib.file_digest(file, "blake2b").digest())

    def _place(self, name: str) -> Path:
        path = self.root / name
        if path.parent not in self._made:
            make_folder(path.parent)
            self._made.add(path.parent)
        return path
