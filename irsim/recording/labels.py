"""Ground truth from a CSV of boxes: ``frame,x,y,w,h[,id,cls]``."""

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
from irsim.recording.messages import FARTHEST
from irsim.types import Box, TargetTruth, Truth

_REQUIRED = ("frame", "x", "y", "w", "h")
_OPTIONAL = ("id", "cls")
_ALLOWED = "allowed: frame,x,y,w,h[,id,cls]"
_DEFAULT_ID = "target"
_MAX_ID_LENGTH = 64
_MAX_NAMED = 3
"""Largest number of targets that a note names."""
_OTHER_SEPARATORS = ";\t| "
"""Separators that other programs write instead of commas."""
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Labels:
    """Labelled targets by frame. A frame without an entry has no targets.

    rows   frames for which the file has a row, blank rows included, by name of the target
    last   highest frame with a row, and the line of this row
    notes  ids that were changed
    """

    path: Path
    targets: dict[int, tuple[TargetTruth, ...]]
    rows: dict[str, frozenset[int]]
    last: tuple[int, int]
    follow: str | None
    notes: tuple[str, ...]

    def truth(self, index: int, time: float, size: tuple[int, int]) -> Truth:
        """Return the truth of a frame of `size` (columns, rows), with `in_view` of each target."""
        targets = (replace(target, in_view=_is_in(target, size)) for target in self.targets.get(index, ()))
        return Truth(index, time, tuple(targets))

    def outside_note(self, size: tuple[int, int]) -> tuple[str, ...]:
        """Return a note with the number of boxes wholly outside a picture of `size` (columns, rows), or ()."""
        columns, rows = size
        boxes = [(frame, target.box) for frame, there in self.targets.items() for target in there]
        # Pixel i reaches from i - 1/2 to i + 1/2.
        outside = [
            frame
            for frame, box in boxes
            if box.right <= -0.5 or box.left >= columns - 0.5 or box.bottom <= -0.5 or box.top >= rows - 0.5
        ]
        if not outside:
            return ()
        first = f"{len(outside)} of {len(boxes)}, first in frame {min(outside)}"
        return (f"boxes outside the picture of {columns}x{rows} px: {first}",)

    def gap_note(self, frames: int) -> tuple[str, ...]:
        """Return a note on frames without rows, in which targets count as absent. It names the targets that lack rows
        between their first and last one. If there are none, it gives the frame after which the file has no rows. If all
        frames have rows, it is ().
        """
        gappy = {name: frames - len(rows) for name, rows in self.rows.items() if len(rows) <= max(rows) - min(rows)}
        if not gappy:
            end, _ = self.last
            if end == frames - 1:
                return ()
            return (
                f"the rows end at frame {end} of 0 to {frames - 1}: after it, in "
                f"{counted(frames - 1 - end, 'frame')}, nothing is taken to be there; "
                "write rows with blank numbers where that is so",
            )
        whole = counted(frames, "frame")
        named = [f"for {name} in {missing} of {whole}" for name, missing in islice(gappy.items(), _MAX_NAMED)]
        if len(gappy) > _MAX_NAMED:
            named.append(f"for {counted(len(gappy) - _MAX_NAMED, 'more target')}")
        return (
            f"no row {', '.join(named)}: taken as absent there; "
            "write a row for each frame, with blank numbers where a target is absent",
        )

    def check_end(self, frames: int) -> None:
        """Raise InputError where a row belongs to a frame after the last one."""
        frame, line = self.last
        if frame >= frames:
            raise InputError(
                f"{self.path}:{line}: frame {frame} is past the end; allowed: 0 to {frames - 1}, counted from 0"
            )


def _is_in(target: TargetTruth, size: tuple[int, int]) -> bool:
    """Return True where the centre of a target is in a picture of `size` (columns, rows)."""
    return all(-0.5 <= at <= side - 0.5 for at, side in zip(target.center, size, strict=True))


def read_labels(path: Path, accuracy_px: float, follow: str | None = None) -> Labels:
    """Read a CSV of boxes: frame from 0, top left corner and size, px. Raises InputError with file:line.

    follow  id of the target to track, or its name; default: the first target

    A target is absent in frames without a row for it and in blank rows. A blank row without an id applies to all
    targets. In an id, characters other than letters, digits, '_' and '-' become '_', and 'target-' precedes an id that
    does not begin with a letter. Without an id the name is 'target'. Centres are those of whole pixels: cx = x + (w -
    1)/2.
    """
    rows = list(_rows(path))
    names: dict[str, str] = {}
    boxes: dict[int, dict[str, tuple[TargetTruth, int]]] = {}
    frames_by_id: dict[str, set[int]] = {}  # keys are the ids in the file
    last = (-1, 0)
    for line, row in rows:
        place = f"{path}:{line}"
        frame = _frame(row["frame"], place)
        last = max(last, (frame, line))
        frames_by_id.setdefault(row.get("id", ""), set()).add(frame)
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
    of_all = frames_by_id.get("", set())
    with_row = {name: frozenset(frames_by_id[raw] | of_all) for raw, name in names.items()}
    return Labels(path, targets, with_row, last, _followed(targets, names, follow, path), changed)


def _followed(
    targets: dict[int, tuple[TargetTruth, ...]], names: dict[str, str], given: str | None, path: Path
) -> str | None:
    """Return the name of the target to track."""
    if given is None:
        return targets[min(targets)][0].id if targets else None
    wanted = names.get(given, given)
    if wanted not in names.values():
        known = ", ".join(names.values()) or "nothing, there are none"
        raise InputError(f"{path}: there is no target '{given}'; allowed: {known}{suggestion(given, names.values())}")
    return wanted


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the line number, and the fields by column name, of each row that is not empty."""
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
    known = (*_REQUIRED, *_OPTIONAL)
    between = next((mark for mark in _OTHER_SEPARATORS if len(columns) == 1 and mark in columns[0]), None)
    if between is not None:
        raise InputError(f"{place}: the columns are separated by {between!r}; {_ALLOWED}, with commas")
    if columns and all(_NUMBER.fullmatch(column) or not column for column in columns):
        raise InputError(f"{place}: the header is missing: the first line names the columns; {_ALLOWED}")
    for column in columns:
        if column not in known:
            raise InputError(f"{place}: unknown column {column!r}; {_ALLOWED}{suggestion(column.lower(), known)}")
        if columns.count(column) > 1:
            raise InputError(f"{place}: the column {column!r} is there twice; {_ALLOWED}")
    missing = [column for column in _REQUIRED if column not in columns]
    if missing:
        raise InputError(f"{place}: missing {', '.join(missing)}; {_ALLOWED}")


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
        # Python's float would accept '1_0' and digits of other scripts.
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not math.isfinite(value):
            raise InputError(f"{place}: {column}: {text!r} is not a number; allowed: px, or all four blank for absent")
        if abs(value) > FARTHEST:
            raise InputError(f"{place}: {column}: {text} is out of range; allowed: -{FARTHEST:g} to {FARTHEST:g} px")
        if column in ("w", "h") and value <= 0:
            raise InputError(f"{place}: {column}: {text} is not a size; allowed: more than 0 px")
        values.append(value)
    return Box.from_pixels(*values)


def _name(raw: str, names: dict[str, str], place: str) -> str:
    """Return the name of a target for an id in the file, and store it in `names`."""
    if raw not in names:
        name = re.sub(r"[^A-Za-z0-9_-]", "_", raw) or _DEFAULT_ID
        if not name[0].isalpha():
            name = f"{_DEFAULT_ID}-{name}"
        if len(name) > _MAX_ID_LENGTH:
            raise InputError(f"{place}: id: {raw!r} is too long; allowed: {_MAX_ID_LENGTH} characters")
        taken = next((other for other, known in names.items() if known == name), None)
        if taken is not None:
            raise InputError(f"{place}: id: {raw!r} and {taken!r} would both be called '{name}'")
        names[raw] = name
    return names[raw]
