"""Pictures that are painted where they are looked at."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels
from irsim.types import Floats

TILE = 128
"""Side of what is painted at once, px: all that is worked out on the way stays in the processor's cache."""

AROUND = 16
"""How much more than a frame sees is laid side by side, to each side, px: the next frames see much the same."""

PaintTile = Callable[[slice, slice], tuple[Floats, Floats]]
"""Rows and columns, within the period -> a layer's transmittance and emission there, float32."""

Words = npt.NDArray[np.int16]

GREATEST = 65535
"""How many units the greatest word stands for; the least, -32768, stands for none."""

DARKEST = 1e-30
"""A layer that is never brighter, W/m2/sr, emits nothing."""


class Tiled:
    """A layer's transmittance and emission at a moment, periodic in (side, side), a multiple of TILE.

    They are kept as words, as a frame reads a lot of them: (word + 32768) units is the value, off by half a unit at
    most. A unit is 1/65535 of the transmittance 1, and of the brightest that the layer can emit, W/m2/sr: if all that
    a 14-bit camera tells is such cloud, an eighth of a count.

    Only what it keeps for speed ever changes. What was last seen is kept apart: a picture whose rows lie side by side
    is read in half the time.
    """

    def __init__(self, side: int, brightest: float, paint: PaintTile) -> None:
        self.side = side
        self.units = 1 / GREATEST, max(brightest, DARKEST) / GREATEST
        self._paint = paint
        self._tiles: dict[tuple[int, int], tuple[Words, Words]] = {}
        nothing = np.empty((0, 0), np.int16)
        self._near: tuple[int, int, Words, Words] = 0, 0, nothing, nothing
        """The first column and row of what was last seen, and it."""

    def window(self, column: int, row: int, width: int, height: int) -> tuple[Words, Words]:
        """(height, width) of each from a column and a row on, only to be read; it may reach past the edges."""
        near = self._near  # once: another thread may put its own there
        if not _holds(near, column, row, width, height):
            first, top = column - AROUND, row - AROUND
            near = self._near = first, top, *self._laid(first, top, width + 2 * AROUND, height + 2 * AROUND)
        first, top, passed, emitted = near
        here = slice(row - top, row - top + height), slice(column - first, column - first + width)
        return passed[here], emitted[here]

    def _laid(self, column: int, row: int, width: int, height: int) -> tuple[Words, Words]:
        """What lies from a column and a row on, side by side."""
        laid = np.empty((height, width), np.int16), np.empty((height, width), np.int16)
        for i, down, rows in _parts(row, height):
            for j, across, columns in _parts(column, width):
                tile = self._tile(i * TILE % self.side, j * TILE % self.side)
                for picture, part in zip(laid, tile, strict=True):
                    picture[down, across] = part[rows, columns]
        return laid

    def _tile(self, row: int, column: int) -> tuple[Words, Words]:
        place = row, column
        if place not in self._tiles:
            self._tiles[place] = self._painted(row, column)
        return self._tiles[place]

    def _painted(self, row: int, column: int) -> tuple[Words, Words]:
        """Transmittance and emission, (TILE, TILE) each."""
        counts = np.empty((2, TILE, TILE), np.uint16)
        painted = self._paint(slice(row, row + TILE), slice(column, column + TILE))
        for field, unit, out in zip(painted, self.units, counts, strict=True):
            _count_units(field, unit, out)
        passed, emitted = _turned(counts).view(np.int16)
        return passed, emitted


def counted(words: Words) -> npt.NDArray[np.uint16]:
    """How many units each word stands for."""
    return _turned(words.view(np.uint16))


def _turned(words: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    """A word's bits from its units', and back: as numbers with a sign, words are weighted two in one step."""
    return words ^ np.uint16(0x8000)


def _holds(near: tuple[int, int, Words, Words], column: int, row: int, width: int, height: int) -> bool:
    first, top, passed, _ = near
    rows, columns = passed.shape
    return bool(0 <= column - first <= columns - width and 0 <= row - top <= rows - height)


def _count_units(field: Floats, unit: float, out: npt.NDArray[np.uint16]) -> None:
    """The nearest units; values below 0, as a sharp lens's kernel has them, are 0."""
    if COMPILED:
        kernels.counts_of(np.ascontiguousarray(field), out, 1 / unit, 0.0, GREATEST, False, None, None)
        return
    levels = field * np.float32(1 / unit)
    np.rint(levels, out=levels)
    out[...] = np.clip(levels, 0, GREATEST, out=levels)


def _parts(begin: int, length: int) -> Iterator[tuple[int, slice, slice]]:
    """The tiles along an axis that meet a stretch of it: their numbers, and the slices of the stretch and of them."""
    end = begin + length
    for number in range(begin // TILE, -(-end // TILE)):
        edge = number * TILE
        first, last = max(begin, edge), min(end, edge + TILE)
        yield number, slice(first - begin, last - begin), slice(first - edge, last - edge)
