"""What a camera showed of the frames of a recording: 8-bit pictures, one of each frame."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path

import numpy as np

from irsim.config.files import is_binary, is_recording
from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.importers import import_frames, name_of
from irsim.render.sources import open_source
from irsim.types import Source
from irsim.wording import counted


@dataclass(frozen=True, eq=False)
class Pictures:
    """Picture k is of frame k; notes on how they were read."""

    source: Source
    notes: tuple[str, ...] = ()


@contextmanager
def open_pictures(display: str | PathLike[str] | Source | None, source: Source) -> Iterator[Pictures | None]:
    """The pictures of a source's frames: a recording, a scenario, or what `irsim import` reads; None for none.

    InputError where they cannot be opened, are deeper, larger or longer than the source, or the source's own frames.
    """
    if display is None:
        yield None
    elif isinstance(display, str | PathLike) and _is_footage(Path(display)):
        path = Path(display)
        with tempfile.TemporaryDirectory(prefix="irsim-fit-") as folder:
            recording = import_frames(path, Path(folder) / f"{name_of(path)}.mcap", rate_hz=source.rate_hz)
            opened = open_recording(recording)
            yield _checked(Pictures(opened, opened.contents.notes), fspath(path), source)
    else:
        opened_source = open_source(display)
        name = fspath(display) if isinstance(display, str | PathLike) else opened_source.name
        yield _checked(Pictures(opened_source), name, source)


def _is_footage(path: Path) -> bool:
    """Whether it is what `irsim import` reads, no recording and no text."""
    return path.is_dir() or (path.is_file() and not is_recording(path) and is_binary(path))


def _checked(pictures: Pictures, name: str, source: Source) -> Pictures:
    opened = pictures.source
    if opened.bits > 8:
        raise InputError(
            f"{name}: {opened.bits} bits deep; allowed: what the camera showed, of 8 bits: a video, a folder of "
            "PNG or TIFF, a .npy or a recording of them"
        )
    if opened.size != source.size:
        raise InputError(f"{name}: {_size(opened)} px, but {source.name} has {_size(source)}; allowed: the same size")
    if len(opened) != len(source):
        raise InputError(
            f"{name}: {counted(len(opened), 'picture')}, but {source.name} has {counted(len(source), 'frame')}; "
            "allowed: as many, picture k of frame k"
        )
    if source.bits <= 8 and all(_same(opened, source, k) for k in {0, len(source) // 2, len(source) - 1}):
        raise InputError(
            f"{name}: its pictures are the frames of {source.name} themselves, which tell of no display; "
            "allowed: the counts as the sensor gave them, and beside them what was shown of these"
        )
    return pictures


def _same(shown: Source, source: Source, k: int) -> bool:
    return np.array_equal(shown.frame(k).image, source.frame(k, "counts").image)


def _size(source: Source) -> str:
    return "x".join(map(str, source.size))
