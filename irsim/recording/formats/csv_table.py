"""CSV of boxes, ``frame,x,y,w,h[,id,cls]``: frames and pixels from 0, x and y of the top left pixel."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from irsim.config.base import suggestion
from irsim.errors import InputError, counted
from irsim.recording.formats.base import (
    NUMBER,
    Clip,
    LabelledFrame,
    LabelRow,
    PictureSet,
    class_of,
    decimal,
    file_text,
    finite,
)
from irsim.types import Box

_REQUIRED = ("frame", "x", "y", "w", "h")
_OPTIONAL = ("id", "cls")
ALLOWED = "allowed: frame,x,y,w,h[,id,cls]"
_OTHER_SEPARATORS = ";\t| "
"""Separators that other programs write instead of commas."""


def read(path: Path, _: PictureSet | None = None) -> Iterator[LabelRow]:
    """Yield the rows of a CSV. A row with four blank numbers: the target, or without an id every target, is absent."""
    for line, row in _rows(path):
        place = f"{path}:{line}"
        frame, box = _frame(row["frame"], place), _box(row, place)
        yield LabelRow(place, f"line {line}", frame, box, row.get("id", ""), row.get("cls") or None)


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the line number, and the fields by column name, of each row that is not empty."""
    reader = csv.reader(file_text(path, ALLOWED).splitlines())
    try:
        columns = [column.strip() for column in next(reader, [])]
        _check_columns(columns, f"{path}:1")
        for fields in reader:
            if not any(field.strip() for field in fields):
                continue
            if len(fields) > len(columns):
                raise InputError(
                    f"{path}:{reader.line_num}: {counted(len(fields), 'field')} for {counted(len(columns), 'column')}"
                )
            padded = [*fields, *[""] * (len(columns) - len(fields))]
            yield reader.line_num, {column: field.strip() for column, field in zip(columns, padded, strict=True)}
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: {error}; {ALLOWED}") from None


def _check_columns(columns: Sequence[str], place: str) -> None:
    known = (*_REQUIRED, *_OPTIONAL)
    between = next((mark for mark in _OTHER_SEPARATORS if len(columns) == 1 and mark in columns[0]), None)
    if between is not None:
        raise InputError(f"{place}: the columns are separated by {between!r}; {ALLOWED}, with commas")
    if columns and all(NUMBER.fullmatch(column) or not column for column in columns):
        raise InputError(f"{place}: the header is missing: the first line names the columns; {ALLOWED}")
    for column in columns:
        if column not in known:
            raise InputError(f"{place}: unknown column {column!r}; {ALLOWED}{suggestion(column.lower(), known)}")
        if columns.count(column) > 1:
            raise InputError(f"{place}: the column {column!r} is there twice; {ALLOWED}")
    missing = [column for column in _REQUIRED if column not in columns]
    if missing:
        raise InputError(f"{place}: missing {', '.join(missing)}; {ALLOWED}")


def _frame(text: str, place: str) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise InputError(f"{place}: frame: {text!r} is not a frame number; allowed: 0, 1, 2, ...")
    return int(text)


def _box(row: dict[str, str], place: str) -> Box | None:
    given = [row[column] for column in _REQUIRED[1:]]
    if not any(given):
        return None
    values = []
    for column, text in zip(_REQUIRED[1:], given, strict=True):
        value = finite(text, f"{place}: {column}", "px, or all four blank for absent")
        if column in ("w", "h") and value <= 0:
            raise InputError(f"{place}: {column}: {text} is not a size; allowed: more than 0 px")
        values.append(value)
    return Box.from_pixels(*values)


class Table:
    """Text of a CSV of a clip, to which frames are added: a row for each frame and target, blank where absent."""

    def __init__(self, clip: Clip) -> None:
        self._clip = clip
        self._lines = ["frame,x,y,w,h,id,cls"]

    def add(self, frame: LabelledFrame) -> None:
        """Append the rows of a frame."""
        found = {target.id: target for target in frame.targets}
        for name in self._clip.ids:
            target = found.get(name)
            numbers = ("", "", "", "") if target is None else map(decimal, target.box.pixels)
            cls = "" if target is None else class_of(target)
            self._lines.append(",".join([str(frame.number), *numbers, name, cls]))

    @property
    def text(self) -> str:
        return "\n".join(self._lines) + "\n"
