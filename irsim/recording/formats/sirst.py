"""SIRST (NUDT-SIRST, IRSTD-1k): a mask for each picture, 255 where a target is; its parts, 8-connected, are targets.

Pictures and masks have the same names, in images/ and masks/; img_idx/ lists the names of each split. Li et al., "Dense
Nested Attention Network", IEEE TIP 32, 1745 (2023).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from irsim.errors import InputError
from irsim.recording.formats.base import Clip, LabelledFrame, LabelRow, PictureSet, numbered_by_class
from irsim.recording.formats.folder import DatasetFolder
from irsim.recording.formats.yolo import label_files
from irsim.types import Box

THRESHOLD = 0.5
"""Share of full scale above which a pixel belongs to a target."""


def read(path: Path, pictures: PictureSet) -> Iterator[LabelRow]:
    """Yield the box of each part of the masks, a folder of PNG files with the names of the pictures."""
    columns, rows = pictures.size
    for file, frame in label_files(path, ".png", pictures):
        yield LabelRow(str(file), file.name, frame, None)
        mask = cv2.imdecode(np.frombuffer(file.read_bytes(), np.uint8), cv2.IMREAD_GRAYSCALE)
        if mask is None:
            raise InputError(f"{file}: is not a PNG picture, or is cut short or damaged")
        if mask.shape != (rows, columns):
            raise InputError(f"{file}: is {mask.shape[1]}x{mask.shape[0]} px, its picture {columns}x{rows}")
        parts, _, found, _ = cv2.connectedComponentsWithStats((mask > THRESHOLD * 255).astype(np.uint8), connectivity=8)
        boxes = [(None, Box.from_pixels(*map(float, found[part, :4]))) for part in range(1, parts)]
        for name, box in numbered_by_class(boxes):
            yield LabelRow(str(file), file.name, frame, box, name)


def write(folder: DatasetFolder, clip: Clip, frames: Iterator[LabelledFrame]) -> list[str]:
    """Write the pictures and masks of a clip; return their names without ending."""
    names = []
    for frame in frames:
        mask = np.zeros(frame.image.shape, np.uint8)
        for target in frame.targets:
            if frame.masks is not None and target.id in frame.masks:
                mask[frame.masks[target.id]] = 255
        names.append(f"{clip.name}_{frame.number:06}")
        folder.picture(f"images/{names[-1]}.png", frame.image)
        folder.picture(f"masks/{names[-1]}.png", mask)
    return names


def finish(folder: DatasetFolder, parts: Sequence[tuple[Clip, list[str]]]) -> None:
    """Write the names of each split, img_idx/SPLIT_NAME.txt, NAME being the name of the folder."""
    for split in dict.fromkeys(clip.split_or_train for clip, _ in parts):
        names = [f"{name}\n" for clip, found in parts if clip.split_or_train == split for name in found]
        folder.text(f"img_idx/{split}_{folder.root.resolve().name}.txt", "".join(names))
