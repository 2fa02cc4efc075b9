"""Pictures that are painted where they are looked at."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from irsim.types import Floats

TILE = 128
"""Side of what is painted at once, px: all that is worked out on the way stays in the processor's cache."""

AROUND = 16
"""How much more than a frame sees is laid side by side, to each side, px: the next frames see much the same."""

PaintTile = Callable[[slice, slice], tuple[Floats, Floats]]
"""Rows and columns, within the period -> a layer's transmittance and emission there, float32."""


class Tiled:
    """A layer's transmittance and emission at a moment, periodic in (side, side), a multiple of TILE.

    Only what it keeps for speed ever changes. What was last seen is kept apart: a picture whose rows lie side by side
    is read in half the time.
    """

    def __init__(self, side: int, paint: PaintTile) -> None:
        self.side = side
        self._paint = paint
        self._tiles: dict[tuple[int, int], tuple[Floats, Floats]] = {}
        self._near: tuple[Floats, Floats] = np.empty((0, 0), np.float32), np.empty((0, 0), np.float32)
        self._corner = (0, 0)

    def window(self, column: int, row: int, width: int, height: int) -> tuple[Floats, Floats]:
        """(height, width) of each from a column and a row on; it may reach past the edges."""
        left, top = column - self._corner[0], row - self._corner[1]
        rows, columns = self._near[0].shape
        if not (0 <= left <= columns - width and 0 <= top <= rows - height):
            left, top = AROUND, AROUND
            self._corner = column - left, row - top
            self._near = self._laid(*self._corner, width + 2 * AROUND, height + 2 * AROUND)
        passed, emitted = (field[top : top + height, left : left + width] for field in self._near)
        return passed, emitted

    def _laid(self, column: int, row: int, width: int, height: int) -> tuple[Floats, Floats]:
        passed, emitted = (np.empty((height, width), np.float32) for _ in range(2))
        for i, down, rows in _parts(row, height):
            for j, across, columns in _parts(column, width):
                tile = self._tile(i * TILE % self.side, j * TILE % self.side)
                for picture, part in zip((passed, emitted), tile, strict=True):
                    picture[down, across] = part[rows, columns]
        return passed, emitted

    def _tile(self, row: int, column: int) -> tuple[Floats, Floats]:
        place = row, column
        if place not in self._tiles:
            self._tiles[place] = self._paint(slice(row, row + TILE), slice(column, column + TILE))
        return self._tiles[place]


def _parts(begin: int, length: int) -> Iterator[tuple[int, slice, slice]]:
    """The tiles along an axis that meet a stretch of it: their numbers, and the slices of the stretch and of them."""
    end = begin + length
    for number in range(begin // TILE, -(-end // TILE)):
        edge = number * TILE
        first, last = max(begin, edge), min(end, edge + TILE)
        yield number, slice(first - begin, last - begin), slice(first - edge, last - edge)
