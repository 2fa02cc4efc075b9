"""Folder of real clips to compare with: `places.csv`, and a clip for each name in it.

`places.csv` has the columns clip, place, class, x0, y0, x1, y1: the region of a clip, [x0, x1) x [y0, y1) px, that
shows a class of background, and the clip's place. The clip NAME is NAME.mcap, or a folder NAME of pictures, or of one
video or array `frames.*`; labels may be in NAME/gt.csv.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from irsim.calibration.patches import BURST, SIDE_PX, Patches, PatchGroup, burst_starts, cut_patches, some
from irsim.calibration.selection import BOX_MARGIN_PX, Progress, Region, target_boxes
from irsim.errors import InputError
from irsim.recording import open_recording
from irsim.recording.formats.base import PictureSet
from irsim.recording.images import open_pictures
from irsim.recording.importers import DEFAULT_ACCURACY_PX
from irsim.recording.labels import read_labels
from irsim.types import Box

PLACES = "places.csv"
COLUMNS = ("clip", "place", "class", "x0", "y0", "x1", "y1")
_MOST_FRAMES = 600
_COLOURLESS = 16
"""Largest difference between channels that a codec leaves in grey pictures, grey levels; 20 clips have up to 5."""
_STILL = 6
"""Largest range of an overlay's pixel over a clip, grey levels: what a codec leaves of a constant."""
_STROKE_PX, _STROKE_HEIGHT = 5, 60
"""Width of the top hat that finds strokes of letters, px, and their least height, grey levels."""
_LETTERS = 4
"""Letters of a line that are taken for text."""
_LETTER_PX = (5, 26)
"""Least and greatest height of a letter, px."""


@dataclass(frozen=True)
class ClipRegion:
    """Region of a clip that shows a class of background, by a row of `places.csv`."""

    line: str
    clip: str
    place: str
    background: str
    region: Region


def is_clip_folder(path: str | Path) -> bool:
    return (Path(path) / PLACES).is_file()


def read_places(folder: Path) -> list[ClipRegion]:
    """Return the rows of `places.csv`. InputError with the line for a wrong one."""
    path = folder / PLACES
    if not path.is_file():
        raise InputError(
            f"{folder}: holds no {PLACES}; allowed: a folder of real clips with columns {','.join(COLUMNS)}"
        )
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        rows = list(csv.DictReader(file))
    if not rows or not set(COLUMNS) <= set(rows[0]):
        raise InputError(f"{path}:1: allowed: the columns {','.join(COLUMNS)}, and a row for each region")
    found = []
    for number, row in enumerate(rows, start=2):
        line = f"{path}:{number}"
        try:
            x0, y0, x1, y1 = (int(row[key]) for key in COLUMNS[3:])
            if not (0 <= x0 <= x1 - SIDE_PX and 0 <= y0 <= y1 - SIDE_PX and row["clip"] and row["class"]):
                raise ValueError
            if Path(row["clip"]).name != row["clip"]:
                raise ValueError
        except (TypeError, ValueError):
            given = ",".join(str(row[key]) for key in COLUMNS)
            raise InputError(
                f"{line}: {given}: allowed: names, and a region x0,y0,x1,y1 of at least {SIDE_PX}x{SIDE_PX} px"
            ) from None
        region = Region(x0, y0, x1 - x0, y1 - y0)
        found.append(ClipRegion(line, row["clip"], row["place"] or row["clip"], row["class"], region))
    return found


def read_clips(folder: Path, progress: Progress | None = None) -> Mapping[str, Sequence[PatchGroup]]:
    """Return the patches of a folder's places by class of background.

    InputError for clips of several sizes, colours, burnt-in text, more than 8 bits, and regions outside the picture.
    """
    places = read_places(folder)
    by_clip = {each.clip: [row for row in places if row.clip == each.clip] for each in places}
    found: dict[str, dict[str, list[Patches]]] = defaultdict(lambda: defaultdict(list))
    first: tuple[str, tuple[int, int]] | None = None
    for done, (name, rows) in enumerate(by_clip.items(), start=1):
        frames, boxes = _read_clip(folder, name)
        size = frames.shape[2], frames.shape[1]
        first = first or (name, size)
        if size != first[1]:
            raise InputError(
                f"{folder}: {name} is {size[0]}x{size[1]} px and {first[0]} {first[1][0]}x{first[1][1]}; "
                "allowed: clips of one size"
            )
        for row in rows:
            region = row.region
            if region.x + region.w > size[0] or region.y + region.h > size[1]:
                raise InputError(f"{row.line}: does not fit; allowed: a region inside {size[0]}x{size[1]} px")
            if (at := burnt_in_text(frames[:, region.rows, region.columns])) is not None:
                x, y = region.x + at[0], region.y + at[1]
                raise InputError(f"{row.line}: {name} has burnt-in text at {x},{y}; allowed: regions without text")
            for start in burst_starts(len(frames)):
                held = list(chain(*boxes[start : start + BURST]))
                found[row.background][row.place].append(cut_patches(frames[start : start + BURST], region, held))
        if progress is not None:
            progress(done, len(by_clip))
    return {
        background: [
            PatchGroup(place, patches)
            for place, cut in groups.items()
            if len(patches := some(cut, f"{background} {place}"))
        ]
        for background, groups in found.items()
    }


def _read_clip(folder: Path, name: str) -> tuple[Patches, Sequence[Sequence[Region]]]:
    """Return frames (T, rows, columns) of a clip, and the boxes of targets in each."""
    recording = folder / f"{name}.mcap"
    if recording.is_file():
        source = open_recording(recording)
        stop = min(len(source), _MOST_FRAMES)
        frames: Any = np.stack([frame.image for frame in source.frames("display", 0, stop)])
        return frames.astype(np.uint8, copy=False), target_boxes(source, 0, stop) or [()] * stop
    clip = folder / name
    if not clip.is_dir():
        raise InputError(f"{folder}: holds no clip {name!r}; allowed: {name}.mcap, or pictures in the folder {name}")
    single = sorted(file for file in clip.iterdir() if file.stem == "frames" and file.is_file())
    images: list[Patches] = []
    for picture in islice(open_pictures(single[0] if single else clip).read(), _MOST_FRAMES):
        if picture.colour_range > _COLOURLESS:
            raise InputError(
                f"{picture.place}: has colours, as of an overlay or a false-colour palette; allowed: grey pictures"
            )
        if picture.image.dtype != np.uint8:
            raise InputError(
                f"{picture.place}: has 16 bits; allowed: 8 bits as the camera delivers them, or a recording"
            )
        if images and picture.image.shape != images[0].shape:
            raise InputError(f"{picture.place}: differs in size from the first; allowed: pictures of one size")
        images.append(picture.image.astype(np.uint8, copy=False))
    if len(images) < BURST:
        raise InputError(f"{clip}: has {len(images)} frames; allowed: at least {BURST}")
    return np.stack(images), _boxes(clip / "gt.csv", images[0].shape, len(images))


def _boxes(path: Path, shape: tuple[int, ...], count: int) -> Sequence[Sequence[Region]]:
    if not path.is_file():
        return [()] * count
    labels = read_labels(path, DEFAULT_ACCURACY_PX, pictures=PictureSet((shape[1], shape[0]), count))
    return [[_region(target.box) for target in labels.targets.get(k, ())] for k in range(count)]


def _region(box: Box) -> Region:
    left, top = (max(int(edge) - BOX_MARGIN_PX, 0) for edge in (box.left, box.top))
    right, bottom = (max(int(edge) + BOX_MARGIN_PX + 2, 0) for edge in (box.right, box.bottom))
    return Region(left, top, right - left, bottom - top)


def burnt_in_text(frames: Patches) -> tuple[int, int] | None:
    """Return the place (x, y) of the first letter of a line of text in frames (T, rows, columns), or None.

    Letters are thin strokes, bright or dark, of constant grey over the clip, of equal height on one line.
    """
    picked = frames[:: max(len(frames) // 24, 1)]
    still = np.ptp(picked, axis=0) <= _STILL
    middle = np.median(picked, axis=0).astype(np.uint8)
    kernel = np.ones((_STROKE_PX, _STROKE_PX), np.uint8)
    for hat in (cv2.MORPH_TOPHAT, cv2.MORPH_BLACKHAT):
        strokes = (cv2.morphologyEx(middle, hat, kernel) >= _STROKE_HEIGHT) & still
        if (at := _line_of_letters(strokes.astype(np.uint8))) is not None:
            return at
    return None


def _line_of_letters(strokes: npt.NDArray[np.uint8]) -> tuple[int, int] | None:
    low, high = _LETTER_PX
    _, _, boxes, _ = cv2.connectedComponentsWithStats(strokes, connectivity=8)
    letters = [box[:4] for box in boxes[1:] if low <= box[3] <= high and box[2] <= high]
    for x, y, _, height in sorted(map(tuple, letters)):
        line = [
            other
            for other in letters
            if abs(other[1] + other[3] - y - height) <= 1 and abs(other[3] - height) <= 1
            if abs(other[0] - x) <= 8 * height
        ]
        if len(line) >= _LETTERS:
            return int(x), int(y)
    return None
