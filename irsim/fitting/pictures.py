"""What a camera showed of the frames of a recording: 8-bit pictures, one of each frame."""

from __future__ import annotations

from os import PathLike, fspath

from irsim.errors import InputError
from irsim.sources import open_source
from irsim.types import Source
from irsim.wording import counted


def open_pictures(display: str | PathLike[str] | Source, source: Source) -> Source:
    """The pictures of a source's frames; InputError where it cannot be opened, or is deeper, larger or longer."""
    opened = open_source(display)
    name = fspath(display) if isinstance(display, str | PathLike) else opened.name
    if opened.bits > 8:
        raise InputError(
            f"{name}: {opened.bits} bits deep; allowed: what the camera showed, of 8 bits (irsim import of its video)"
        )
    if opened.size != source.size:
        raise InputError(f"{name}: {_size(opened)} px, but {source.name} has {_size(source)}; allowed: the same size")
    if len(opened) != len(source):
        raise InputError(
            f"{name}: {counted(len(opened), 'picture')}, but {source.name} has {counted(len(source), 'frame')}; "
            "allowed: as many, picture k of frame k"
        )
    return opened


def _size(source: Source) -> str:
    return "x".join(map(str, source.size))
