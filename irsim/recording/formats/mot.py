"""MOT Challenge: ``frame,id,left,top,width,height,conf,class,visibility``; frames, ids and pixels are counted from 1.

A sequence is a folder with img1/000001.png, gt/gt.txt and seqinfo.ini. `gt/labels.txt` names the classes, one a line,
as CVAT writes it. Milan et al., "MOT16", arXiv 1603.00831, section 4.
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
    class_of,
    decimal,
    file_text,
    finite,
    rows_of_numbers,
    sized,
)
from irsim.recording.formats.folder import DatasetFolder

FIRST = 1
"""Number of the first frame, and of the first pixel's column and row."""
_LEAST_FIELDS = 6
_CONFIDENCE, _CLASS, _VISIBILITY = 6, 7, 8
_ALLOWED = "frame,id,left,top,width,height[,conf,class,visibility]"


def read(path: Path, _: PictureSet | None = None) -> Iterator[LabelRow]:
    """Yield the rows of a gt.txt, or of the sequence's folder. Rows of confidence 0, which evaluation ignores, are left
    out."""
    file = path / "gt" / "gt.txt" if path.is_dir() else path
    names = _classes(file.with_name("labels.txt"))
    for line, fields in rows_of_numbers(file):
        place = f"{file}:{line}"
        if len(fields) < _LEAST_FIELDS:
            raise InputError(f"{place}: holds {len(fields)} numbers; allowed: {_ALLOWED}")
        frame, number, left, top, width, height, *others = (finite(text, place) for text in fields)
        if frame < FIRST or frame % 1 or number % 1:
            raise InputError(
                f"{place}: frame {fields[0]}, id {fields[1]}: allowed: whole numbers, frames counted from {FIRST}"
            )
        if others and others[0] == 0:
            continue
        box = sized((left - FIRST, top - FIRST, width, height), place)
        visible = others[2] if len(others) > 2 and 0 <= others[2] <= 1 else None
        cls = _class(names, int(others[1]), place) if len(others) > 1 else None
        yield LabelRow(place, f"line {line}", int(frame) - FIRST, box, f"{int(number)}", cls, visible)


def _classes(file: Path) -> list[str]:
    names = file_text(file, "allowed: a name a line").splitlines() if file.is_file() else []
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise InputError(f"{file}: two classes are called {repeated!r}; allowed: different names")
    return names


def _class(names: Sequence[str], number: int, place: str) -> str | None:
    if not names:
        return None
    if not 1 <= number <= len(names):
        raise InputError(f"{place}: class {number} has no name in labels.txt; allowed: 1 to {len(names)}")
    return names[number - 1]


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as a sequence; return its name."""
    place, lines = f"{clip.split_or_train}/{clip.name}", []
    for frame in frames:
        folder.picture(f"{place}/img1/{frame.number + FIRST:06}.png", frame.image)
        for target in frame.targets:
            x, y, w, h = target.box.pixels
            visible = 1.0 if target.visible is None else target.visible
            numbers = [frame.number + FIRST, clip.ids.index(target.id) + 1, x + FIRST, y + FIRST, w, h, 1]
            numbers += [clip.classes.index(class_of(target)) + 1, visible]
            lines.append(",".join(map(decimal, numbers)) + "\n")
    folder.text(f"{place}/gt/gt.txt", "".join(lines))
    folder.text(f"{place}/gt/labels.txt", "".join(f"{name}\n" for name in clip.classes))
    facts = {"name": clip.name, "imDir": "img1", "frameRate": decimal(clip.rate_hz), "seqLength": clip.frames}
    facts |= {"imWidth": clip.size[0], "imHeight": clip.size[1], "imExt": ".png"}
    folder.text(f"{place}/seqinfo.ini", "[Sequence]\n" + "".join(f"{key}={value}\n" for key, value in facts.items()))
    return clip.name


def finish(folder: DatasetFolder, parts: Sequence[tuple[Clip, str]]) -> None:
    """Write the list of the sequences of each split, as TrackEval reads it."""
    for split in dict.fromkeys(clip.split_or_train for clip, _ in parts):
        names = [name for clip, name in parts if clip.split_or_train == split]
        folder.text(f"seqmaps/{split}.txt", "".join(f"{line}\n" for line in ["name", *names]))
