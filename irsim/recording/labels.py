"""Ground truth from label files: the labels of all formats in one shape (`recording.formats` reads them)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from irsim.config.base import suggestion
from irsim.errors import InputError, counted
from irsim.recording.formats import label_format
from irsim.recording.formats.base import LabelRow, PictureSet, touches
from irsim.types import Box, TargetTruth, Truth

_DEFAULT_ID = "target"
_MAX_ID_LENGTH = 64
_MAX_NAMED = 3
"""Largest number of targets that a note names."""


@dataclass(frozen=True)
class Labels:
    """Labelled targets by frame. A frame without an entry has no targets.

    rows    frames for which the file has a row, blank rows included, by name of the target
    last    highest frame with a row, and the place of this row
    notes   the format, and ids that were changed
    first   number of the first frame in the file
    sparse  True: a frame without a row has no targets, and is nothing to note
    """

    path: Path
    targets: dict[int, tuple[TargetTruth, ...]]
    rows: dict[str, frozenset[int]]
    last: tuple[int, str]
    follow: str | None
    notes: tuple[str, ...]
    first: int = 0
    sparse: bool = False

    def truth(self, index: int, time: float, size: tuple[int, int]) -> Truth:
        """Return the truth of a frame of `size` (columns, rows), with `in_view` of each target."""
        targets = (replace(target, in_view=_is_in(target, size)) for target in self.targets.get(index, ()))
        return Truth(index, time, tuple(targets))

    def outside_note(self, size: tuple[int, int]) -> tuple[str, ...]:
        """Return a note with the number of boxes wholly outside a picture of `size` (columns, rows), or ()."""
        columns, rows = size
        boxes = [(frame, target.box) for frame, there in self.targets.items() for target in there]
        outside = [frame for frame, box in boxes if not touches(box, size)]
        if not outside:
            return ()
        first = f"{len(outside)} of {len(boxes)}, first in frame {min(outside)}"
        return (f"boxes outside the picture of {columns}x{rows} px: {first}",)

    def gap_note(self, frames: int) -> tuple[str, ...]:
        """Return a note on frames without rows, in which targets count as absent. It names the targets that lack rows
        between their first and last one. If there are none, it gives the frame after which the file has no rows. If all
        frames have rows, it is ().
        """
        if self.sparse:
            return ()
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
        (frame, place), first = self.last, self.first
        if frame >= frames:
            raise InputError(
                f"{place}: frame {frame + first} is past the end; allowed: {first} to {frames - 1 + first}, "
                f"counted from {first}"
            )


def _is_in(target: TargetTruth, size: tuple[int, int]) -> bool:
    """Return True where the centre of a target is in a picture of `size` (columns, rows)."""
    return all(-0.5 <= at <= side - 0.5 for at, side in zip(target.center, size, strict=True))


def read_labels(
    path: Path,
    accuracy_px: float,
    follow: str | None = None,
    pictures: PictureSet | None = None,
    format: str | None = None,
) -> Labels:
    """Read labels of any format of `formats.READERS`. Raises InputError with the place of the fault.

    follow    id of the target to track, or its name; default: the first target
    pictures  size, number and files of the pictures
    format    name of the format; default: the one recognised from the labels

    A target is absent in frames without a row for it and in blank rows. A blank row without an id applies to all
    targets. In an id, characters other than letters, digits, '_' and '-' become '_', and 'target-' precedes an id that
    does not begin with a letter. Without an id the name is 'target'. Centres are those of whole pixels: cx = x + (w -
    1)/2.
    """
    name, reader = label_format(path, format)
    rows = reader.read(path, pictures or PictureSet((1, 1)))
    labels = replace(_collected(path, rows, accuracy_px, follow, reader.first), sparse=reader.sparse)
    notes = list(labels.notes)
    if name != "csv":
        notes.insert(0, f"{path.name} is read as {name}: {reader.looks}")
    if not reader.has_ids:
        notes.append("labels without ids: those of a frame are numbered in order, and are no tracks")
    return replace(labels, notes=tuple(notes))


def _collected(path: Path, rows: Iterable[LabelRow], accuracy_px: float, follow: str | None, first: int) -> Labels:
    """Return the labels in rows. InputError for a target that is twice in a frame, and where there are no rows."""
    names: dict[str, str] = {}
    boxes: dict[int, dict[str, tuple[TargetTruth, str]]] = {}
    frames_by_id: dict[str, set[int]] = {}  # keys are the ids in the file
    last = (-1, "")
    for row in rows:
        last = max(last, (row.frame, row.place), key=lambda each: each[0])
        frames_by_id.setdefault(row.id, set()).add(row.frame)
        if row.box is None:
            continue
        name = _name(row.id, names, row.place)
        there = boxes.setdefault(row.frame, {})
        if name in there:
            frame, earlier = row.frame + first, there[name][1]
            raise InputError(f"{row.place}: frame {frame} has '{name}' in {earlier} already; allowed: once")
        there[name] = _target(name, row.box, row, accuracy_px), row.item
    if last[0] < 0:
        raise InputError(f"{path}: holds no row; allowed: frame,x,y,w,h[,id,cls]")
    targets = {frame: tuple(target for target, _ in there.values()) for frame, there in boxes.items()}
    changed = [f"id {raw!r} is called {name}" for raw, name in names.items() if raw and raw != name]
    if len(changed) > _MAX_NAMED:
        changed[_MAX_NAMED:] = [f"{counted(len(changed) - _MAX_NAMED, 'more id')} in the same way"]
    of_all = frames_by_id.get("", set())
    with_row = {name: frozenset(frames_by_id[raw] | of_all) for raw, name in names.items()}
    return Labels(path, targets, with_row, last, _followed(targets, names, follow, path), tuple(changed), first)


def _target(name: str, box: Box, row: LabelRow, accuracy_px: float) -> TargetTruth:
    return TargetTruth(name, (box.cx, box.cy), box, cls=row.cls, visible=row.visible, accuracy_px=accuracy_px)


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
