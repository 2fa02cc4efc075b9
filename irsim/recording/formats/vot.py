"""VOT: a line a frame, ``x,y,w,h`` of the top left pixel, counted from 0, or the corners of a polygon.

A rectangle reaches from x to x + w, as its polygon does; `nan` or a single number: the target is absent. A sequence is
a folder with groundtruth.txt, `sequence`, and pictures in ir/00000001.png. Read by vot-toolkit 0.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from irsim.errors import InputError
from irsim.recording.formats.base import (
    Clip,
    LabelledFrame,
    LabelRow,
    PictureSet,
    decimal,
    finite,
    rows_of_numbers,
    sized,
)
from irsim.recording.formats.folder import DatasetFolder
from irsim.types import Box

_RECTANGLE = 4
_LEAST_OF_POLYGON = 6
ABSENT = "nan,nan,nan,nan"


def read(path: Path, _: PictureSet | None = None) -> Iterator[LabelRow]:
    """Yield the regions of a groundtruth.txt, or of the sequence's folder; of a polygon its box."""
    file = path / "groundtruth.txt" if path.is_dir() else path
    for frame, (line, fields) in enumerate(rows_of_numbers(file)):
        place = f"{file}:{line}"
        yield LabelRow(place, f"line {line}", frame, _region(fields, place))


def _region(fields: Sequence[str], place: str) -> Box | None:
    if fields[0].startswith("m"):
        raise InputError(f"{place}: is a mask; allowed: rectangles x,y,w,h and polygons x,y,x,y,x,y,...")
    if len(fields) == 1 or any(text.lower() == "nan" for text in fields):
        return None
    values = [finite(text, place) for text in fields]
    if len(values) == _RECTANGLE:
        return None if values[2:] == [0, 0] else sized(values, place)
    if len(values) < _LEAST_OF_POLYGON or len(values) % 2:
        raise InputError(f"{place}: holds {len(values)} numbers; allowed: 4 of a rectangle, 6, 8, ... of a polygon")
    xs, ys = values[::2], values[1::2]
    return sized((min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys)), place)


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as a sequence; return its name."""
    place, lines = f"{clip.folder}sequences/{clip.name}", []
    for frame in frames:
        folder.picture(f"{place}/ir/{frame.number + 1:08}.png", frame.image)
        target = clip.followed(frame.targets)
        lines.append(ABSENT if target is None else ",".join(map(decimal, target.box.pixels)))
    folder.text(f"{place}/groundtruth.txt", "".join(f"{line}\n" for line in lines))
    facts = {"name": clip.name, "fps": max(round(clip.rate_hz), 1), "format": "default", "channel.default": "ir"}
    facts |= {"channels.ir": "ir/%08d.png", "width": clip.size[0], "height": clip.size[1], "length": clip.frames}
    folder.text(f"{place}/sequence", "".join(f"{key}={value}\n" for key, value in facts.items()))
    return clip.name


def finish(folder: DatasetFolder, parts: Sequence[tuple[Clip, str]]) -> None:
    """Write the list of sequences of each workspace."""
    for place in dict.fromkeys(clip.folder for clip, _ in parts):
        names = [f"{name}\n" for clip, name in parts if clip.folder == place]
        folder.text(f"{place}sequences/list.txt", "".join(names))
