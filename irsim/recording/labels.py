"""Truth from a CSV of boxes: ``frame,x,y,w,h[,id,cls]``."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from irsim.config.base import suggestion
from irsim.config.paths import text_bytes
from irsim.errors import InputError, counted
from irsim.types import Box, TargetTruth, Truth

_NEEDED = ("frame", "x", "y", "w", "h")
_OPTIONAL = ("id", "cls")
_ALLOWED = "allowed: frame,x,y,w,h[,id,cls]"
_ONLY_ID = "target"
_LONGEST_ID = 64
_NAMED = 3
"""Targets that one note names."""
_NO_SEPARATORS = ";\t| "
"""What other programs put between columns."""
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Labels:
    """The labelled targets of each frame; a frame without an entry has none.

    rows   the frames with a row for each target, those with blank numbers among them
    last   the highest frame with a row, and the line it stands in
    notes  how ids were changed
    """

    path: Path
    targets: dict[int, tuple[TargetTruth, ...]]
    rows: dict[str, frozenset[int]]
    last: tuple[int, int]
    follow: str | None
    notes: tuple[str, ...]

    def truth(self, index: int, time: float, size: tuple[int, int]) -> Truth:
        """The truth of a frame of `size` (columns, rows); it knows of each centre whether it is in view."""
        return Truth(index, time, tuple(_placed(target, size) for target in self.targets.get(index, ())))

    def strays(self, size: tuple[int, int]) -> tuple[str, ...]:
        """A note that counts the boxes in which no part of a picture of `size` (columns, rows) lies, if there are."""
        columns, rows = size
        boxes = [(frame, target.box) for frame, there in self.targets.items() for target in there]
        outside = [frame for frame, box in boxes if not _meets(box, columns, rows)]
        if not outside:
            return ()
        count = f"{len(outside)} of {len(boxes)}, first in frame {min(outside)}"
        return (f"boxes outside the picture of {columns}x{rows} px: {count}",)

    def gaps(self, frames: int) -> tuple[str, ...]:
        """A note that names the targets for which frames between their first and last row have none, if there are; or
        else that says where all rows end, if before the last frame.

        Labels of every tenth frame, or of the first minute, would otherwise pass silently for targets mostly absent.
        """
        gappy = {name: frames - len(rows) for name, rows in self.rows.items() if len(rows) <= max(rows) - min(rows)}
        if not gappy:
            return self._early_end(frames)
        whole = counted(frames, "frame")
        named = [f"for {name} in {missing} of {whole}" for name, missing in islice(gappy.items(), _NAMED)]
        if len(gappy) > _NAMED:
            named.append(f"for {counted(len(gappy) - _NAMED, 'more target')}")
        return (
            f"no row {', '.join(named)}: taken as absent there; "
            "write a row for each frame, with blank numbers where a target is absent",
        )

    def _early_end(self, frames: int) -> tuple[str, ...]:
        end, _ = self.last
        if end == frames - 1:
            return ()
        after = counted(frames - 1 - end, "frame")
        return (
            f"the rows end at frame {end} of 0 to {frames - 1}: after it, in {after}, nothing is taken to be there; "
            "write rows with blank numbers where that is so",
        )

    def check_end(self, frames: int) -> None:
        """InputError where a row is about a frame that is not there."""
        frame, line = self.last
        if frame >= frames:
            raise InputError(
                f"{self.path}:{line}: frame {frame} is past the end; allowed: 0 to {frames - 1}, counted from 0"
            )


def _meets(box: Box, columns: int, rows: int) -> bool:
    """Does any of a picture lie in a box? Pixel i reaches from i - 1/2 to i + 1/2."""
    return box.right > -0.5 and box.left < columns - 0.5 and box.bottom > -0.5 and box.top < rows - 0.5


def _placed(target: TargetTruth, size: tuple[int, int]) -> TargetTruth:
    """With whether its centre is in view."""
    in_view = all(-0.5 <= at <= side - 0.5 for at, side in zip(target.center, size, strict=True))
    return replace(target, in_view=in_view)


def read_labels(path: Path, accuracy_px: float, follow: str | None = None) -> Labels:
    """Read boxes by top-left corner and size in px, whole or fractional.

    Blank numbers, and frames without a row, mean absent; a row with blank numbers and no id is about all targets.

    `follow` is an id of the file or the name that it becomes; the first target is followed without it.

    Frames count from 0. Several rows may be about one frame, with ids of their own. An id becomes a
    valid name: other characters than letters, digits, '_' and '-' become '_', and 'target-' goes before
    one that does not begin with a letter; where there is none it is 'target'. Centres follow from
    whole-pixel boxes: cx = x + (w - 1)/2. InputError with file:line for everything that is wrong.
    """
    rows = list(_rows(path))
    names: dict[str, str] = {}
    boxes: dict[int, dict[str, tuple[TargetTruth, int]]] = {}
    told: dict[str, set[int]] = {}  # by ids as the file has them
    last = (-1, 0)
    for line, row in rows:
        place = f"{path}:{line}"
        frame = _frame(row["frame"], place)
        last = max(last, (frame, line))
        told.setdefault(row.get("id", ""), set()).add(frame)
        box = _box(row, place)
        if box is None:
            continue
        name = _name(row.get("id", ""), names, place)
        there = boxes.setdefault(frame, {})
        if name in there:
            raise InputError(f"{place}: frame {frame} has '{name}' in line {there[name][1]} already; allowed: once")
        target = TargetTruth(name, (box.cx, box.cy), box, cls=row.get("cls") or None, accuracy_px=accuracy_px)
        there[name] = (target, line)
    if not rows:
        raise InputError(f"{path}: holds no row; {_ALLOWED}")
    targets = {frame: tuple(target for target, _ in there.values()) for frame, there in boxes.items()}
    changed = tuple(f"id {raw!r} is called {name}" for raw, name in names.items() if raw and raw != name)
    of_all = told.get("", set())
    with_row = {name: frozenset(told[raw] | of_all) for raw, name in names.items()}
    return Labels(path, targets, with_row, last, _followed(targets, names, follow, path), changed)


def _followed(
    targets: dict[int, tuple[TargetTruth, ...]], names: dict[str, str], asked: str | None, path: Path
) -> str | None:
    """The name of who is followed."""
    if asked is None:
        return targets[min(targets)][0].id if targets else None
    wanted = names.get(asked, asked)
    if wanted not in names.values():
        known = ", ".join(names.values()) or "nothing, there are none"
        raise InputError(f"{path}: there is no target '{asked}'; allowed: {known}{suggestion(asked, names.values())}")
    return wanted


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Line number and fields by column of each row that is not empty."""
    try:
        text = text_bytes(path).decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file (UTF-8); {_ALLOWED}") from None
    reader = csv.reader(text.splitlines())
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
        raise InputError(f"{path}:{reader.line_num}: {error}; {_ALLOWED}") from None


def _check_columns(columns: Sequence[str], place: str) -> None:
    known = (*_NEEDED, *_OPTIONAL)
    between = next((mark for mark in _NO_SEPARATORS if len(columns) == 1 and mark in columns[0]), None)
    if between is not None:
        raise InputError(f"{place}: {between!r} stands between the columns; {_ALLOWED}, with commas")
    if columns and all(_NUMBER.fullmatch(column) or not column for column in columns):
        raise InputError(f"{place}: the header is missing: the first line names the columns; {_ALLOWED}")
    for column in columns:
        if column not in known:
            raise InputError(f"{place}: unknown column {column!r}; {_ALLOWED}{suggestion(column.lower(), known)}")
        if columns.count(column) > 1:
            raise InputError(f"{place}: the column {column!r} is there twice; {_ALLOWED}")
    missing = [column for column in _NEEDED if column not in columns]
    if missing:
        raise InputError(f"{place}: missing {', '.join(missing)}; {_ALLOWED}")


def _frame(text: str, place: str) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise InputError(f"{place}: frame: {text!r} is not a frame number; allowed: 0, 1, 2, ...")
    return int(text)


def _box(row: dict[str, str], place: str) -> Box | None:
    given = [row[column] for column in _NEEDED[1:]]
    if not any(given):
        return None
    values = []
    for column, text in zip(_NEEDED[1:], given, strict=True):
        # Python's float would take '1_0' and digits of other scripts as well.
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not math.isfinite(value):
            raise InputError(f"{place}: {column}: {text!r} is not a number; allowed: px, or all four blank for absent")
        if column in ("w", "h") and value <= 0:
            raise InputError(f"{place}: {column}: {text} is not a size; allowed: more than 0 px")
        values.append(value)
    return Box.from_pixels(*values)


def _name(raw: str, names: dict[str, str], place: str) -> str:
    """The target's name for an id in the file; remembers it in `names`."""
    if raw not in names:
        name = re.sub(r"[^A-Za-z0-9_-]", "_", raw) or _ONLY_ID
        if not name[0].isalpha():
            name = f"{_ONLY_ID}-{name}"
        if len(name) > _LONGEST_ID:
            raise InputError(f"{place}: id: {raw!r} is too long; allowed: {_LONGEST_ID} characters")
        taken = next((other for other, known in names.items() if known == name), None)
        if taken is not None:
            raise InputError(f"{place}: id: {raw!r} and {taken!r} would both be called '{name}'")
        names[raw] = name
    return names[raw]
