"""A rectangle of whole pixels that travels with a target's sub-pixel centre.

A target's centre is rarely a pixel's centre, and a window covers whole pixels. The window is laid
on the start box once; how far the box's centre lies from the window's (the *phase*, at most half a
pixel on each axis) is kept and undone whenever a centre is turned into a window or back. Otherwise
every estimate would be off by that much.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from irsim.types import Box, Floats, Image

Integers = npt.NDArray[np.intp]
AnyArray = TypeVar("AnyArray", bound=npt.NDArray[np.generic])


@dataclass(frozen=True, slots=True)
class Window:
    """columns x rows of whole pixels; phase (x, y) px = target's centre less the window's."""

    columns: int
    rows: int
    phase: tuple[float, float]

    @classmethod
    def of(cls, box: Box) -> Window:
        """The window of a box: its sizes rounded to whole pixels, at least one."""
        columns, rows = max(1, round(box.w)), max(1, round(box.h))
        x, y = box.cx - (columns - 1) / 2, box.cy - (rows - 1) / 2
        return cls(columns, rows, (x - floor(x + 0.5), y - floor(y + 0.5)))

    def inside(self, corner: tuple[int, int], shape: tuple[int, int]) -> tuple[Window, tuple[int, int]]:
        """The part of the window at `corner` that lies in a frame of `shape`, and its own corner.

        The part keeps the target's centre: its phase grows by what was cut off. It may be empty.
        """
        left, top = max(corner[0], 0), max(corner[1], 0)
        columns = max(min(corner[0] + self.columns, shape[1]) - left, 0)
        rows = max(min(corner[1] + self.rows, shape[0]) - top, 0)
        x, y = self.center(corner)
        return Window(columns, rows, (x - left - (columns - 1) / 2, y - top - (rows - 1) / 2)), (left, top)

    def cut(self, image: AnyArray, corner: tuple[int, int]) -> AnyArray:
        """(rows, columns) of the image where the top-left pixel is at `corner`; it must lie inside."""
        part: AnyArray = image[corner[1] : corner[1] + self.rows, corner[0] : corner[0] + self.columns]  # type: ignore[assignment]  # numpy's stubs lose the kind of array
        return part

    @property
    def reach(self) -> tuple[float, float]:
        """What floor() of a centre less this gives the nearest corner: half a pixel short of it."""
        return self.phase[0] + (self.columns - 1) / 2 - 0.5, self.phase[1] + (self.rows - 1) / 2 - 0.5

    def corners(self, centers: Floats) -> Integers:
        """(..., 2) column and row of the top-left pixel for target centres (..., 2) px, each contiguous."""
        whole: Integers = np.floor(centers - np.array(self.reach)).astype(np.intp, order="F")
        return whole

    def corner(self, center: tuple[float, float]) -> tuple[int, int]:
        """The same for one centre."""
        x, y = self.reach
        return floor(center[0] - x), floor(center[1] - y)

    def center(self, corner: tuple[float, float]) -> tuple[float, float]:
        """The target's centre where the top-left pixel is at `corner` (may lie between pixels)."""
        return (
            corner[0] + (self.columns - 1) / 2 + self.phase[0],
            corner[1] + (self.rows - 1) / 2 + self.phase[1],
        )

    def offsets(self) -> tuple[Floats, Floats]:
        """(rows, columns) x and y of each pixel's centre from the target's centre, px."""
        x = np.arange(self.columns) - (self.columns - 1) / 2 - self.phase[0]
        y = np.arange(self.rows) - (self.rows - 1) / 2 - self.phase[1]
        return np.broadcast_to(x, (self.rows, self.columns)), np.broadcast_to(y[:, None], (self.rows, self.columns))


def region(
    image: Image, window: Window, corner: tuple[int, int], reach: int | tuple[int, int] | None
) -> tuple[int, int, Image]:
    """(left, top, pixels) of what a window covers when moved by up to `reach` px from `corner`.

    reach is one number or (x, y); None is the whole frame. What lies beyond the frame is left out,
    but the window always fits: its corner is first brought to the nearest place inside.
    """
    height, width = image.shape
    if reach is None:
        return 0, 0, image
    rx, ry = (reach, reach) if isinstance(reach, int) else reach
    x, y = min(max(corner[0], 0), width - window.columns), min(max(corner[1], 0), height - window.rows)
    left, top = max(x - rx, 0), max(y - ry, 0)
    return left, top, image[top : y + ry + window.rows, left : x + rx + window.columns]
