"""`file`: detections from a file, and the reader of CSV and MOTChallenge rows, which also serves files of tracks."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from irsim import scalar
from irsim.config.base import suggestion
from irsim.types import Box, Frame
from irtrack.detectors.base import DetectorPart
from irtrack.errors import InputError
from irtrack.types import FARTHEST_PX, Detection, Detections

DETECTION_COLUMNS = ("frame", "cx", "cy", "w", "h", "score", "class")
MOT_COLUMNS = ("frame", "id", "left", "top", "w", "h", "score")
"""First columns of MOTChallenge text; frames, left and top count from 1."""

NOTHING = Detections(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))


class FileDetector(DetectorPart):
    """Detections read from a file: those of the frame's index; none where the file has none.

    .csv   columns `DETECTION_COLUMNS` in any order, of which class may be absent, others are ignored; as
           `irtrack run DETECTOR SCENE --csv FILE.csv` writes it
    .txt   MOTChallenge det.txt: `MOT_COLUMNS`, others are ignored
    """

    source: ClassVar[str] = "CSV, or MOTChallenge (Leal-Taixe et al. 2015)"

    path: str = Field(min_length=1, max_length=4096)
    """Path of the file, .csv or .txt."""

    def step(self, state: Any, frame: Frame) -> tuple[None, Detections]:
        return None, self.by_frame.get(frame.index, NOTHING)

    @property
    def weights(self) -> tuple[str, ...]:
        """File, whose content is part of the key of a run; InputError where it cannot be read."""
        self.by_frame  # noqa: B018 - reads the file
        return (self.path,)

    @cached_property
    def by_frame(self) -> dict[int, Detections]:
        """Detections by index of the frame; InputError with file and line."""
        found: dict[int, list[Detection]] = {}
        for row in box_rows(Path(self.path), DETECTION_COLUMNS[:-1]):
            score = row.number("score")
            detection = Detection(row.box, score, row.cells.get("class") or None)
            found.setdefault(row.frame, []).append(detection)
        return {frame: Detections.of(rows) for frame, rows in found.items()}


def file_spec(path: object) -> str:
    """Return the spec of the detector of a file; InputError, with file and line, where the file is wrong."""
    given = FileDetector(path=str(path))
    given.by_frame  # noqa: B018 - reads the file
    return f"file:path={given.path if scalar(given.path) == given.path else json.dumps(given.path)}"


class Row:
    """Line of a file of boxes: its cells by column, its frame from 0 on, and its box."""

    def __init__(self, place: str, cells: dict[str, str], is_mot: bool) -> None:
        self.place, self.cells = place, cells
        self.frame = int(self.number("frame", "a whole number", lambda value: value == int(value))) - is_mot
        if self.frame < 0:
            raise self._error("frame", f"{int(is_mot)} or more")
        w, h = (self.number(name, f"above 0, up to {FARTHEST_PX:g}", lambda value: value > 0) for name in ("w", "h"))
        if is_mot:
            self.box = Box(self.number("left") - 1 + (w - 1) / 2, self.number("top") - 1 + (h - 1) / 2, w, h)
        else:
            self.box = Box(self.number("cx"), self.number("cy"), w, h)

    def number(self, column: str, allowed: str = "", rule: Callable[[float], bool] = lambda value: True) -> float:
        """Return the number in a column; InputError with file and line for text that is no allowed number."""
        try:
            value = float(self.cells[column])
            if math.isfinite(value) and (abs(value) <= FARTHEST_PX or column in ("frame", "score")) and rule(value):
                return value
        except ValueError:
            pass
        raise self._error(column, allowed or "a finite number")

    def one_of(self, column: str, allowed: Sequence[str]) -> None:
        """Raise InputError unless the text in a column is one of `allowed`."""
        if self.cells[column] not in allowed:
            raise self._error(column, ", ".join(allowed))

    def _error(self, column: str, allowed: str) -> InputError:
        return InputError(f"{self.place}: {column} '{self.cells[column]}': allowed: {allowed}")


def box_rows(path: Path, columns: Sequence[str]) -> Iterator[Row]:
    """Yield the rows of a CSV file with these columns and perhaps others, or of MOTChallenge text; blank lines are left
    out. InputError with file and line."""
    ending = path.suffix.lower()
    if ending not in (".csv", ".txt"):
        raise InputError(f"{path}: allowed: a file that ends in .csv (columns {', '.join(columns)}) or .txt (MOT)")
    is_mot = ending == ".txt"
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            lines = csv.reader(file)
            head = list(MOT_COLUMNS) if is_mot else _head(path, next(lines, []), columns)
            for cells in lines:
                if any(cell.strip() for cell in cells):
                    place = f"{path}:{lines.line_num}"
                    if len(cells) < len(head):
                        raise InputError(
                            f"{place}: {len(cells)} cells; allowed: at least {len(head)} ({','.join(head)})"
                        )
                    yield Row(place, dict(zip(head, map(str.strip, cells), strict=False)), is_mot)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: is no text table: {error}") from None


def _head(path: Path, cells: Sequence[str], columns: Sequence[str]) -> list[str]:
    head = [cell.strip() for cell in cells]
    lacking = [name for name in columns if name not in head]
    if lacking:
        others = [name for name in head if name not in columns]
        raise InputError(
            f"{path}:1: no column '{lacking[0]}'; allowed: {', '.join(columns)}{suggestion(lacking[0], others)}"
        )
    return head
