"""Rectangle of whole pixels that follows a target's sub-pixel centre.

The window is set on the start box once. The offset of the box's centre from the window's centre (the *phase*, at most
half a pixel on each axis) is kept, and added where a centre is computed from a window.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from irsim.types import Box, Floats, Image

AnyArray = TypeVar("AnyArray", bound=npt.NDArray[np.generic])
Reach = int | tuple[int, int] | None
"""Largest displacement in a search, px, on both axes or (x, y); None: the whole frame."""


@dataclass(frozen=True, slots=True)
class Window:
    """Window of columns x rows pixels; phase (x, y) px: the target's centre less the window's."""

    columns: int
    rows: int
    phase: tuple[float, float]

    @classmethod
    def of(cls, box: Box) -> Window:
        """Return the window of a box, its sides rounded to whole pixels, at least one."""
        columns, rows = max(1, round(box.w)), max(1, round(box.h))
        x, y = box.cx - (columns - 1) / 2, box.cy - (rows - 1) / 2
        return cls(columns, rows, (x - floor(x + 0.5), y - floor(y + 0.5)))

    def inside(self, corner: tuple[int, int], shape: tuple[int, int]) -> tuple[Window, tuple[int, int]]:
        """Return the part of the window at `corner` in a frame of `shape`, perhaps empty, and its corner.

        The part keeps the target's centre: its phase grows by the pixels cut off.
        """
        left, top = max(corner[0], 0), max(corner[1], 0)
        columns = max(min(corner[0] + self.columns, shape[1]) - left, 0)
        rows = max(min(corner[1] + self.rows, shape[0]) - top, 0)
        x, y = self.center(corner)
        return Window(columns, rows, (x - left - (columns - 1) / 2, y - top - (rows - 1) / 2)), (left, top)

    def cut(self, image: AnyArray, corner: tuple[int, int]) -> AnyArray:
        """Return the pixels (rows, columns) of the window with its top-left pixel at `corner`, inside the frame."""
        part: AnyArray = image[corner[1] : corner[1] + self.rows, corner[0] : corner[0] + self.columns]  # type: ignore[assignment]  # numpy's stubs lose the kind of array
        return part

    @property
    def corner_offset(self) -> tuple[float, float]:
        """Offset (x, y) px by which floor(centre - offset) is the top-left pixel of the nearest window."""
        return self.phase[0] + (self.columns - 1) / 2 - 0.5, self.phase[1] + (self.rows - 1) / 2 - 0.5

    def corner(self, center: tuple[float, float]) -> tuple[int, int]:
        """Return column and row of the top-left pixel of the window at a target's centre, px."""
        x, y = self.corner_offset
        return floor(center[0] - x), floor(center[1] - y)

    def center(self, corner: tuple[float, float]) -> tuple[float, float]:
        """Return the target's centre for a top-left pixel at `corner`, which may lie between pixels."""
        return (corner[0] + (self.columns - 1) / 2 + self.phase[0], corner[1] + (self.rows - 1) / 2 + self.phase[1])

    def offsets(self) -> tuple[Floats, Floats]:
        """Return x (columns,) and y (rows,) of the pixels' centres from the target's centre, px."""
        x = np.arange(self.columns) - (self.columns - 1) / 2 - self.phase[0]
        y = np.arange(self.rows) - (self.rows - 1) / 2 - self.phase[1]
        return x, y


def region(image: Image, window: Window, corner: tuple[int, int], reach: Reach) -> tuple[int, int, Image]:
    """Return (left, top, pixels) of the search region, covered by a window moved by up to `reach` from `corner`.

    Pixels beyond the frame are left out. The corner is first moved to the nearest position at which the window lies
    inside the frame.
    """
    height, width = image.shape
    if reach is None:
        return 0, 0, image
    rx, ry = (reach, reach) if isinstance(reach, int) else reach
    x, y = min(max(corner[0], 0), width - window.columns), min(max(corner[1], 0), height - window.rows)
    left, top = max(x - rx, 0), max(y - ry, 0)
    return left, top, image[top : y + ry + window.rows, left : x + rx + window.columns]


def overlaps(one: Floats, other: Floats) -> Floats:
    """Return the IoU (n, m) of boxes (n, 4) and (m, 4): cx, cy, w, h."""
    low = np.maximum((one[:, :2] - one[:, 2:] / 2)[:, None], (other[:, :2] - other[:, 2:] / 2)[None])
    high = np.minimum((one[:, :2] + one[:, 2:] / 2)[:, None], (other[:, :2] + other[:, 2:] / 2)[None])
    shared = np.maximum(high - low, 0).prod(axis=2)
    total: Floats = shared / (one[:, 2:].prod(axis=1)[:, None] + other[:, 2:].prod(axis=1)[None] - shared)
    return total
