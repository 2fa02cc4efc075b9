"""Values that readers and writers of labels of other programs share."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from irsim.config.paths import Stamp, stamp, text_bytes
from irsim.errors import InputError
from irsim.recording.messages import FARTHEST
from irsim.types import Bools, Box, Image, TargetTruth

NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""Number in a text file. Python's float would accept '1_0' and digits of other scripts."""


@dataclass(frozen=True)
class LabelRow:
    """One label of one frame, as a reader yields it.

    place    file and position in it, for messages, such as `gt.txt:12`
    item     position in the file, such as `line 12`
    frame    number of the frame, from 0
    box      None: the target is absent; of a row without an id: every target is
    id       id in the file; '' where the file has one target only
    visible  visible fraction 0..1, where the format has one
    """

    place: str
    item: str
    frame: int
    box: Box | None
    id: str = ""
    cls: str | None = None
    visible: float | None = None


@dataclass(frozen=True)
class PictureSet:
    """Pictures of labels: size (columns, rows), number (None: not known), and the files of a folder, in order."""

    size: tuple[int, int]
    count: int | None = None
    files: tuple[Path, ...] = ()

    def frames_by_stem(self, labels: Path) -> dict[str, int]:
        """Return the number of the frame of each picture, by its name without ending. InputError without a folder."""
        if not self.files:
            raise InputError(f"{labels}: names pictures; allowed with a folder of pictures only")
        return {file.stem: index for index, file in enumerate(self.files)}


@dataclass(frozen=True)
class Clip:
    """One sequence of a data set.

    name     of the scene and seed, unique in the data set
    split    train, val or test; '' where the data set is not split
    size     (columns, rows)
    bits     of the pictures as they are written
    ids      of all targets in the clip, in order; the number of a target in files is its place here, from 1
    follow   id of the target that formats of one target hold
    classes  all classes of the data set, in the order of their numbers
    """

    name: str
    split: str
    size: tuple[int, int]
    bits: int
    rate_hz: float
    frames: int
    ids: tuple[str, ...]
    follow: str | None
    classes: tuple[str, ...]

    @property
    def split_or_train(self) -> str:
        """Split, or `train` for formats that need one."""
        return self.split or "train"

    @property
    def folder(self) -> str:
        """Folder of the clip's split, with a slash, or ''."""
        return f"{self.split}/" if self.split else ""

    def followed(self, targets: Iterable[TargetTruth]) -> TargetTruth | None:
        """Return the label of the target that formats of one target hold."""
        return next((target for target in targets if target.id == self.follow), None)


@dataclass(frozen=True, eq=False)
class LabelledFrame:
    """Picture of a clip with its labelled targets.

    number  of the frame in the clip, from 0
    masks   pixels of each target's visible part, (rows, columns), by id; None where they are not known
    """

    number: int
    time: float
    image: Image
    targets: tuple[TargetTruth, ...]
    masks: Mapping[str, Bools] | None = None


@dataclass
class Numbers:
    """Whole numbers in order of first use, from `first` on, by key."""

    first: int = 1
    by_key: dict[Any, int] = field(default_factory=dict)

    def of(self, key: Any) -> int:
        return self.by_key.setdefault(key, self.first + len(self.by_key))


def class_of(target: TargetTruth) -> str:
    """Return a target's class in files: `target` where it has none."""
    return target.cls or "target"


def decimal(value: float) -> str:
    """Return a number with at most ten significant digits and no exponent."""
    return f"{value:.10f}".rstrip("0").rstrip(".") if abs(value) < 1e9 else f"{value:.0f}"


def clipped(box: Box, size: tuple[int, int]) -> Box:
    """Return the part of a box inside a picture of `size` (columns, rows), which it must touch."""
    columns, rows = size
    left, top, right, bottom = box.edges
    return Box.from_edges(max(left, -0.5), max(top, -0.5), min(right, columns - 0.5), min(bottom, rows - 0.5))


def touches(box: Box, size: tuple[int, int]) -> bool:
    """Return True where a part of the box is inside a picture of `size` (columns, rows)."""
    columns, rows = size
    return box.right > -0.5 and box.left < columns - 0.5 and box.bottom > -0.5 and box.top < rows - 0.5


def finite(text: str, place: str, allowed: str = "a number") -> float:
    """Return the number in a text; InputError with its place for anything else, and for infinite numbers."""
    value = float(text) if NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise InputError(f"{place}: {text!r} is not a number; allowed: {allowed}")
    if abs(value) > FARTHEST:
        raise InputError(f"{place}: {text} is out of range; allowed: -{FARTHEST:g} to {FARTHEST:g} px")
    return value


def sized(pixels: Sequence[float], place: str) -> Box:
    """Return the box of pixels (x, y, w, h), x and y of the first one, counted from 0. InputError for an empty box."""
    x, y, w, h = pixels
    if not (w > 0 and h > 0):
        raise InputError(f"{place}: a box of {decimal(w)} x {decimal(h)} px; allowed: more than 0 px")
    return Box.from_pixels(x, y, w, h)


def file_text(path: Path, allowed: str) -> str:
    """Return the text of a UTF-8 file. InputError where it cannot be read, or is no text."""
    try:
        return text_bytes(path).decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file (UTF-8); {allowed}") from None


def rows_of_numbers(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the fields of each line that is not empty, split at commas, tabs and spaces."""
    for number, line in enumerate(file_text(path, "allowed: lines of numbers").splitlines(), 1):
        if fields := fields_of(line):
            yield number, fields


def fields_of(line: str) -> list[str]:
    """Return the fields of a line, split at commas, semicolons, tabs and spaces."""
    return re.split(r"\s*[,;\s]\s*", stripped) if (stripped := line.strip().rstrip(",;")) else []


def json_value(path: Path) -> Any:
    """Return the value in a JSON file, which must not be changed. InputError where it is no JSON."""
    return _json_value(path, stamp(path)) if path.is_file() else _parsed(path)


@lru_cache(maxsize=1)
def _json_value(path: Path, _: Stamp) -> Any:
    return _parsed(path)


def _parsed(path: Path) -> Any:
    try:
        return json.loads(file_text(path, "allowed: JSON"))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}:{error.colno}: is not JSON: {error.msg}") from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply; allowed: JSON of labels") from None


def numbered_by_class(found: Iterable[tuple[str | None, Any]]) -> Iterator[tuple[str, Any]]:
    """Yield (id, value) of the labels of one frame, (class, value), in a format without ids: `drone-1`, `drone-2`."""
    counts: dict[str, int] = {}
    for cls, value in found:
        name = cls or "target"
        counts[name] = counts.get(name, 0) + 1
        yield f"{name}-{counts[name]}", value
