"""Patches of background: bursts of three neighbouring 8-bit frames, without targets.

Patches are cut as they are: nothing is scaled, filtered or filled in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from irsim.calibration.selection import Region, box_mask, target_boxes
from irsim.errors import InputError
from irsim.rng import stream
from irsim.types import Source

SIDE_PX = 48
STEP_PX = 16
BURST = 3
BURSTS = 8
"""Bursts, evenly spaced over a clip."""
PATCHES = 64
"""Most patches of a place or a scene in one class of background."""
SCENES = 4
"""Scenes that a scenario gives, by its seed and the next ones."""

Patches = npt.NDArray[np.uint8]
"""(n, BURST, SIDE_PX, SIDE_PX) patches."""
Boxes = Callable[[int], Sequence[Region]]
"""Function that returns the boxes of targets, with a margin, of a frame."""


@dataclass(frozen=True, eq=False)
class PatchGroup:
    """Patches of one place or one rendered scene."""

    name: str
    patches: Patches


def burst_starts(frames: int) -> list[int]:
    """Return the first frames of at most `BURSTS` bursts in a clip of so many frames; none if it is too short."""
    last = frames - BURST
    return [] if last < 0 else sorted(set(np.linspace(0, last, BURSTS).round().astype(int).tolist()))


def cut_patches(burst: Patches, region: Region, boxes: Sequence[Region]) -> Patches:
    """Return the patches of a burst (BURST, rows, columns) inside a region that no box touches."""
    taken = box_mask(boxes, burst.shape[1:])
    found = []
    for top in range(region.y, region.y + region.h - SIDE_PX + 1, STEP_PX):
        for left in range(region.x, region.x + region.w - SIDE_PX + 1, STEP_PX):
            place = slice(top, top + SIDE_PX), slice(left, left + SIDE_PX)
            if not taken[place].any():
                found.append(burst[:, place[0], place[1]])
    return np.array(found, np.uint8).reshape(-1, BURST, SIDE_PX, SIDE_PX)


def some(patches: Sequence[Patches], name: str, most: int = PATCHES) -> Patches:
    """Return at most `most` patches, drawn by the group's name."""
    every: Patches = np.concatenate([*patches, np.empty((0, BURST, SIDE_PX, SIDE_PX), np.uint8)])
    if len(every) <= most:
        return every
    chosen = stream(0, "realism", "patches", name).permutation(len(every))[:most]
    return np.asarray(every[np.sort(chosen)])


def source_patches(source: Source, name: str, region: Region | None = None) -> PatchGroup:
    """Return patches of a source's 8-bit display. InputError where it has none: frames, size or targets."""
    columns, rows = source.size
    where = Region(0, 0, columns, rows) if region is None else region
    if min(where.w, where.h) < SIDE_PX:
        raise InputError(f"{name}: {where.w}x{where.h} px hold no patch; allowed: at least {SIDE_PX}x{SIDE_PX}")
    starts, found = burst_starts(len(source)), []
    if not starts:
        raise InputError(f"{name}: has {len(source)} frames; allowed: at least {BURST}")
    for start in starts:
        burst: Any = np.stack([frame.image for frame in source.frames("display", start, start + BURST)])
        boxes = target_boxes(source, start, start + BURST) or ()
        found.append(cut_patches(burst.astype(np.uint8), where, [box for of in boxes for box in of]))
    patches = some(found, name)
    if not len(patches):
        raise InputError(f"{name}: targets cover every patch; allowed: background without targets")
    return PatchGroup(name, patches)
