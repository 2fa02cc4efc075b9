"""Formats of data sets of other programs: one file each, one line each in the tables of readers and writers."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from irsim.config.base import suggestion
from irsim.errors import InputError
from irsim.recording.formats import (
    anti_uav,
    arrays,
    coco,
    csv_table,
    mot,
    rerun,
    ros2,
    sirst,
    video,
    voc,
    vot,
    yolo,
)
from irsim.recording.formats.base import NUMBER, Clip, LabelledFrame, LabelRow, PictureSet, fields_of, json_value
from irsim.recording.formats.folder import DatasetFolder
from irsim.types import Input

_HEAD = 4096
"""Number of first characters by which the kind of a text file is recognised."""


class LabelFormat(NamedTuple):
    """Reader of labels, and the look of their files.

    first    number of the first frame in the file
    has_ids  False: labels of one frame are not known to be those of another
    sparse   True: a frame without a row has no targets, and is nothing to note
    """

    read: Callable[[Path, PictureSet], Iterator[LabelRow]]
    looks: str
    first: int = 0
    has_ids: bool = True
    sparse: bool = True


class DatasetFormat(NamedTuple):
    """Writer of a clip, which returns what `finish` needs of it; `finish` writes the files of the whole set.

    inputs  pictures that the format can hold, the default first
    masks   whether the writer uses masks, and fails without them
    target  True: one target only, the one to follow
    needs   module of another package that the writer imports, and the extra of irtrack that installs it
    """

    write: Callable[[DatasetFolder, Clip, Iterator[LabelledFrame]], Any]
    finish: Callable[[DatasetFolder, Sequence[tuple[Clip, Any]]], None] | None = None
    inputs: tuple[Input, ...] = ("display", "counts")
    masks: Literal["unused", "where known", "needed"] = "unused"
    target: bool = False
    needs: tuple[str, str] | None = None


READERS: dict[str, LabelFormat] = {
    "csv": LabelFormat(csv_table.read, "a CSV with the header frame,x,y,w,h", sparse=False),
    "mot": LabelFormat(mot.read, "lines of 6 to 10 numbers that begin with frame,id", first=mot.FIRST),
    "vot": LabelFormat(vot.read, "a line of 4, 6, 8, ... numbers a frame", sparse=False),
    "coco": LabelFormat(coco.read, "JSON with images and annotations"),
    "yolo": LabelFormat(yolo.read, "a folder of .txt files", has_ids=False),
    "voc": LabelFormat(voc.read, "a folder of .xml files", has_ids=False),
    "anti-uav": LabelFormat(anti_uav.read, "JSON with exist and gt_rect", sparse=False),
    "sirst": LabelFormat(sirst.read, "a folder of .png masks", has_ids=False),
    "ros2": LabelFormat(ros2.read, "a ROS 2 bag of vision_msgs/Detection2DArray"),
}

WRITERS: dict[str, DatasetFormat] = {
    "coco": DatasetFormat(coco.write, coco.finish, masks="where known"),
    "yolo": DatasetFormat(yolo.write, yolo.finish),
    "mot": DatasetFormat(mot.write, mot.finish),
    "vot": DatasetFormat(vot.write, vot.finish, target=True),
    "anti-uav": DatasetFormat(anti_uav.write, inputs=("display",), target=True),
    "sirst": DatasetFormat(sirst.write, sirst.finish, masks="needed"),
    "png": DatasetFormat(arrays.write_png, inputs=("counts", "display")),
    "npz": DatasetFormat(arrays.write_npz, inputs=("counts", "display")),
    "mp4": DatasetFormat(video.write, inputs=("display",), needs=("av", "video")),
    "rrd": DatasetFormat(rerun.write, needs=("rerun", "rerun")),
    "ros2": DatasetFormat(ros2.write, inputs=("counts", "display"), needs=("rosbags", "ros2")),
}


def dataset_format(name: str) -> DatasetFormat:
    """Return the writer of that name. InputError for another name, and where a package that it needs is missing."""
    if name not in WRITERS:
        raise InputError(f"format {name!r}: allowed: {', '.join(WRITERS)}{suggestion(str(name), WRITERS)}")
    needs = WRITERS[name].needs
    if needs is not None and importlib.util.find_spec(needs[0]) is None:
        raise InputError(f"format {name}: needs {needs[0]}: pip install 'irtrack[{needs[1]}]'")
    return WRITERS[name]


def label_format(path: Path, given: str | None = None) -> tuple[str, LabelFormat]:
    """Return the format of labels, by name or as recognised from their content. InputError where their content is in
    another format."""
    if given is not None and given not in READERS:
        raise InputError(f"format {given!r}: allowed: {', '.join(READERS)}{suggestion(given, READERS)}")
    possible = possible_formats(path)
    if given is None:
        return possible[0], READERS[possible[0]]
    if given not in possible:
        found = possible[0]
        raise InputError(f"{path}: looks like {found} ({READERS[found].looks}), not {given}; allowed: {found}")
    return given, READERS[given]


def possible_formats(path: Path) -> tuple[str, ...]:
    """Return the formats that labels may have, the likeliest first; csv where nothing is recognised."""
    if path.is_dir():
        if (path / "gt" / "gt.txt").is_file():
            return ("mot",)
        if (path / "groundtruth.txt").is_file():
            return ("vot",)
        if (path / "metadata.yaml").is_file():
            return ("ros2",)
        endings = {file.suffix.lower() for file in path.iterdir()}
        found = [name for ending, name in ((".txt", "yolo"), (".xml", "voc"), (".png", "sirst")) if ending in endings]
        if not found:
            raise InputError(f"{path}: holds no labels; allowed: a folder of .txt (YOLO), .xml (VOC) or .png (masks)")
        return tuple(found)
    try:
        with open(path, encoding="utf-8-sig") as file:
            head = file.read(_HEAD) if path.is_file() else ""
    except (OSError, UnicodeDecodeError):
        return ("csv",)  # its reader reports the error
    if head.lstrip().startswith(("{", "[")):
        value = json_value(path)
        return ("anti-uav",) if isinstance(value, dict) and "gt_rect" in value else ("coco",)
    return _formats_of_lines([fields for line in head.splitlines() if (fields := fields_of(line))])


def _formats_of_lines(lines: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the formats that fit the fields of each line: a VOT polygon and a MOT row may have equal field counts."""
    lengths = {len(fields) for fields in lines if not _is_absent(fields)}
    if not lines or not all(_is_number(text) for text in lines[0]):
        return ("vot",) if lines and lines[0][0].startswith("m") else ("csv",)
    as_mot = bool(lengths) and min(lengths) >= 6 and max(lengths) <= 10
    as_vot = all(length == 4 or (length >= 6 and length % 2 == 0) for length in lengths)
    if as_mot and all(_is_row_of_mot(fields) for fields in lines[:-1] or lines):  # the last may be cut short
        return ("mot", "vot") if as_vot else ("mot",)
    if as_vot:
        return ("vot", "mot") if as_mot else ("vot",)
    return ("mot",) if as_mot else ("csv",)


def _is_row_of_mot(fields: Sequence[str]) -> bool:
    """Return True where frame and id are whole and the confidence, a coordinate of a polygon, is from -1 to 1."""
    whole = all(re.fullmatch(r"-?[0-9]+(\.0*)?", text) for text in fields[:2])
    return whole and all(_is_number(text) and abs(float(text)) <= 1 for text in fields[6:7])


def _is_absent(fields: Sequence[str]) -> bool:
    return len(fields) == 1 or any(text.lower() == "nan" for text in fields)


def _is_number(text: str) -> bool:
    return NUMBER.fullmatch(text) is not None or text.lower() == "nan"
