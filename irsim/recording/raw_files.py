"""Raw files of counts: frames one after the other, in a layout that the user states."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from irsim.errors import InputError, counted
from irsim.recording.images import Picture, Pictures

ALLOWED = "ROWS,COLUMNS,TYPE[,header=BYTES][,gap=BYTES]"
_TYPES = {"uint8": "u1", "uint16": "<u2", "uint16be": ">u2"}


class Layout(NamedTuple):
    """Layout of a raw file.

    dtype   type of a count, with its byte order
    header  bytes before the first frame
    gap     bytes before each frame, such as its own header
    """

    rows: int
    columns: int
    dtype: str
    header: int = 0
    gap: int = 0

    @property
    def frame_bytes(self) -> int:
        return self.rows * self.columns * np.dtype(self.dtype).itemsize


def parse_layout(text: str) -> Layout:
    """Return the layout of a text such as `512,640,uint16,header=1024`. InputError for any other text."""
    fields = [field.strip() for field in text.split(",")]
    more = dict(field.partition("=")[::2] for field in fields[3:])
    sides, wrong = [*fields[:2], *more.values()], set(more) - {"header", "gap"}
    whole = len(fields) >= 3 and all(side.isascii() and side.isdigit() and len(side) < 12 for side in sides)
    if not whole or wrong or len(more) != len(fields) - 3 or fields[2] not in _TYPES or "0" in fields[:2]:
        raise InputError(f"layout {text}: allowed: {ALLOWED}, TYPE {', '.join(_TYPES)}, as 512,640,uint16,header=1024")
    return Layout(int(fields[0]), int(fields[1]), _TYPES[fields[2]], *(int(more.get(k, 0)) for k in ("header", "gap")))


def open_raw(path: Path, layout: Layout) -> Pictures:
    """Open a raw file. InputError where its size is not that of whole frames."""
    try:
        size = path.stat().st_size - layout.header if path.is_file() else None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if size is None:
        what = "is a folder" if path.is_dir() else "there is no such file"
        raise InputError(f"{path}: {what}; allowed with a layout: a raw file")
    step = layout.gap + layout.frame_bytes
    count, left = divmod(size, step)
    if count < 1 or left:
        frames = f"{counted(count, 'frame')} and {counted(left, 'byte')}" if count > 0 else "no whole frame"
        raise InputError(f"{path}: holds {frames} of {counted(step, 'byte')} each; allowed: a layout of whole frames")
    return Pictures(partial(_read, path, layout, count), count)


def _read(path: Path, layout: Layout, count: int) -> Iterator[Picture]:
    dtype = np.dtype(layout.dtype)
    with path.open("rb") as file:
        file.seek(layout.header)
        for frame in range(count):
            data = file.read(layout.gap + layout.frame_bytes)[layout.gap :]
            if len(data) < layout.frame_bytes:
                raise InputError(f"{path}: frame {frame}: the file was cut while it was read")
            counts = np.frombuffer(data, dtype).reshape(layout.rows, layout.columns)
            yield Picture(counts.astype(dtype.newbyteorder("=")), f"{path}: frame {frame}", False)
