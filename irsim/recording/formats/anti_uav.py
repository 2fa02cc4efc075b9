"""Anti-UAV: a folder of JPEG pictures with IR_label.json: `exist`, 0 or 1, and `gt_rect`, [x, y, w, h], of each frame.

x and y are those of the top left pixel, counted from 0. Huang et al., "Anti-UAV410", IEEE TPAMI 46, 2852 (2024).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from irsim.errors import InputError, is_number
from irsim.recording.formats.base import Clip, LabelledFrame, LabelRow, PictureSet, json_value, sized
from irsim.recording.formats.folder import DatasetFolder
from irsim.types import Box

_RECTANGLE = 4


def read(path: Path, _: PictureSet | None = None) -> Iterator[LabelRow]:
    """Yield the rectangles of a JSON file. The target is absent where `exist` is 0 or the rectangle is empty."""
    value = json_value(path)
    lists: list[Any] = [value.get(key) for key in ("exist", "gt_rect")] if isinstance(value, dict) else []
    if not lists or not all(isinstance(each, list) for each in lists) or len(lists[0]) != len(lists[1]):
        raise InputError(f"{path}: allowed: two lists of the same length, exist and gt_rect")
    for frame, (exists, rectangle) in enumerate(zip(*lists, strict=True)):
        item = f"gt_rect[{frame}]"
        yield LabelRow(f"{path}: {item}", item, frame, _box(exists, rectangle, f"{path}: {item}"))


def _box(exists: Any, rectangle: Any, place: str) -> Box | None:
    if exists not in (0, 1):
        raise InputError(f"{place}: exist is {exists!r}; allowed: 0 or 1")
    if not exists or not rectangle:
        return None
    if not isinstance(rectangle, list) or len(rectangle) != _RECTANGLE or not all(map(is_number, rectangle)):
        raise InputError(f"{place}: {rectangle!r}: allowed: [x, y, w, h], px")
    return None if not any(rectangle) else sized(list(map(float, rectangle)), place)


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> str:
    """Write a clip as a sequence; return its name. The rectangle of an absent target is [0, 0, 0, 0]."""
    place = f"{clip.folder}{clip.name}"
    labels: dict[str, list[Any]] = {"exist": [], "gt_rect": []}
    for frame in frames:
        folder.picture(f"{place}/{frame.number + 1:06}.jpg", frame.image)
        target = clip.followed(frame.targets)
        labels["exist"].append(int(target is not None))
        labels["gt_rect"].append([0, 0, 0, 0] if target is None else list(target.box.pixels))
    folder.text(f"{place}/IR_label.json", json.dumps(labels) + "\n")
    return clip.name
