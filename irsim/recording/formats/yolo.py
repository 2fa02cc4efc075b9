"""YOLO: a text file a picture, ``class cx cy w h`` a line, as shares of the picture's width and height.

Distances are measured from the picture's edges: the centre of the first of n pixels is at 1/(2n). Classes are counted
from 0 and named in data.yaml. Boxes are cut at the picture's edges, as loaders refuse shares above 1.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from irsim.config.yaml_text import scalar
from irsim.errors import InputError
from irsim.recording.formats.base import (
    Clip,
    LabelledFrame,
    LabelRow,
    PictureSet,
    class_of,
    clipped,
    file_text,
    finite,
    numbered_by_class,
    rows_of_numbers,
)
from irsim.recording.formats.folder import DatasetFolder
from irsim.types import Box

_FIELDS = 5
_NOT_LABELS = ("classes.txt", "obj.names", "labels.txt")
_UP = 3
"""Number of folders above the labels in which data.yaml is looked up."""


def read(path: Path, pictures: PictureSet) -> Iterator[LabelRow]:
    """Yield the boxes of a folder of text files with the names of the pictures."""
    names = _names(path)
    for file, frame in label_files(path, ".txt", pictures):
        yield LabelRow(str(file), file.name, frame, None)
        found = []
        for line, fields in rows_of_numbers(file):
            number, box = _box(fields, f"{file}:{line}", pictures.size)
            cls = f"class-{number}" if names is None else _class(names, number, f"{file}:{line}")
            found.append((cls, (line, cls, box)))
        for name, (line, cls, box) in numbered_by_class(found):
            yield LabelRow(f"{file}:{line}", f"{file.name}:{line}", frame, box, name, cls)


def label_files(path: Path, ending: str, pictures: PictureSet) -> list[tuple[Path, int]]:
    """Return the files of a folder with that ending, each with the number of the frame of its picture, in order."""
    if not path.is_dir():
        raise InputError(f"{path}: is no folder; allowed: a folder with a {ending} file for each picture")
    frames, found = pictures.frames_by_stem(path), []
    for file in sorted(path.glob(f"*{ending}")):
        if file.name not in _NOT_LABELS:
            if file.stem not in frames:
                raise InputError(f"{file}: there is no picture {file.stem}; allowed: labels of the imported pictures")
            found.append((file, frames[file.stem]))
    return sorted(found, key=lambda each: each[1])


def _box(fields: Sequence[str], place: str, size: tuple[int, int]) -> tuple[int, Box]:
    values = [finite(text, place) for text in fields]
    if len(values) != _FIELDS or values[0] < 0 or values[0] % 1:
        raise InputError(f"{place}: allowed: class cx cy w h, the class a whole number from 0 on")
    number, cx, cy, w, h = values
    if not (max(values[1:]) <= 1 and min(values[1:]) >= 0 and w > 0 and h > 0):
        raise InputError(f"{place}: {' '.join(fields[1:])}: allowed: shares of the picture, 0 to 1, sizes above 0")
    columns, rows = size
    return int(number), Box(cx * columns - 0.5, cy * rows - 0.5, w * columns, h * rows)


def _names(path: Path) -> list[str] | None:
    """Return the names of the classes, from data.yaml here or above, or classes.txt beside the labels; else None."""
    listed = path / "classes.txt"
    if listed.is_file():
        names = file_text(listed, "allowed: a name a line").split("\n")
        return _different([name.strip() for name in names if name.strip()], listed)
    for folder in (path, *path.resolve().parents[:_UP]):
        file = folder / "data.yaml"
        if file.is_file():
            return _different(_named_in(file), file)
    return None


def _named_in(file: Path) -> list[str]:
    """Return the list under `names` in a data.yaml, or its values in the order of their numbers."""
    found = re.search(r"^names:(.*(?:\n(?:[ \t-].*)?)*)", file_text(file, "allowed: YAML"), re.M)
    block = found[1] if found else ""
    numbered = re.findall(r"^\s+(\d+)\s*:\s*(.+?)\s*$", block, re.M)
    names = [name for _, name in sorted(numbered, key=lambda each: int(each[0]))]
    listed = names or re.findall(r"^\s*-\s*(.+?)\s*$", block, re.M) or scalar(block.strip() or "[]")
    if not isinstance(listed, list) or not all(isinstance(name, str) for name in listed):
        raise InputError(f"{file}: names: allowed: a list of names")
    return [name.strip("'\"") for name in listed]


def _different(names: list[str], file: Path) -> list[str]:
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise InputError(f"{file}: two classes are called {repeated!r}; allowed: different names")
    return names


def _class(names: Sequence[str], number: int, place: str) -> str:
    if number >= len(names):
        raise InputError(f"{place}: class {number} has no name; allowed: 0 to {len(names) - 1}")
    return names[number]


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> None:
    """Write the pictures and labels of a clip; frames without targets get empty files."""
    columns, rows = clip.size
    for frame in frames:
        name = f"{clip.split_or_train}/{clip.name}_{frame.number:06}"
        folder.picture(f"images/{name}.png", frame.image)
        lines = []
        for target in frame.targets:
            box = clipped(target.box, clip.size)
            shares = (box.cx + 0.5) / columns, (box.cy + 0.5) / rows, box.w / columns, box.h / rows
            lines.append(f"{clip.classes.index(class_of(target))} {' '.join(f'{share:.10f}' for share in shares)}\n")
        folder.text(f"labels/{name}.txt", "".join(lines))


def finish(folder: DatasetFolder, parts: Sequence[tuple[Clip, None]]) -> None:
    """Write data.yaml: folders of the splits, and names of the classes. Without a split, `val` is `train`."""
    splits = dict.fromkeys(clip.split_or_train for clip, _ in parts)
    places = {split: f"images/{split}" for split in splits}
    places.setdefault("val", places.get("test", "images/train"))
    lines = [f"{split}: {place}" for split, place in places.items()]
    classes = parts[0][0].classes
    lines += [f"nc: {len(classes)}", "names: " + json.dumps(list(classes), ensure_ascii=False)]
    folder.text("data.yaml", "".join(f"{line}\n" for line in lines))
