"""Textures, and their place in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.backgrounds.blur import blurred
from irsim.backgrounds.chart import Chart
from irsim.physics.psf import PSF
from irsim.types import Floats

TILE = 1024
"""Side of a texture, px; it repeats beyond."""


ROOM = 64
"""How much farther than a frame a texture is repeated, px: key frames are larger."""

SQUARE = 2048
"""Side up to which a texture is as wide as high, px, whatever the frame."""


@dataclass(frozen=True, eq=False)
class Tile:
    """A periodic texture on the chart's map; repeated past its edges so that a frame needs no wrap, unless it is much
    longer than wide and rolled."""

    shape: tuple[int, int]
    """Its periods, px, down and across."""
    padded: Floats
    phase: tuple[float, float]
    """Where the map's (0, 0) lies between texels: so that a camera at rest sees texels, unblurred by interpolation."""

    @classmethod
    def of(cls, texture: Floats, frame: tuple[int, int], psf: PSF) -> Tile:
        """A texture (rows, columns), as the lens shows it, for frames of (columns, rows)."""
        columns, rows = frame
        (high, wide), most = texture.shape, repeated_px(frame)
        margins = (most, most) if high == wide else (rows + ROOM, columns + ROOM)
        phase = (columns - 1) / 2 % 1, (rows - 1) / 2 % 1  # (0, 0) is the frame's middle
        return cls((high, wide), np.pad(blurred(texture, psf), [(0, margin) for margin in margins], mode="wrap"), phase)

    def places(self, chart: Chart, shift_px: tuple[float, float]) -> tuple[Floats, Floats]:
        """(rows, cols) float32 each: column and row of the texture that each pixel sees."""
        u, v = chart.u - shift_px[0] + self.phase[0], chart.v - shift_px[1] + self.phase[1]
        # Whole periods are taken off before float32, whose steps would grow with distance. The frame's edge lies a
        # little past the outermost nodes, and may be left of 0 still.
        u, v = (at - np.floor(at.min() / period) * period for at, period in zip((u, v), self.shape[::-1], strict=True))
        columns, rows = (
            np.mod(places, period) if places.min() < 0 or places.max() > length - 1 else places
            for places, period, length in zip(
                (chart.spread(u), chart.spread(v)), self.shape[::-1], self.padded.shape[::-1], strict=True
            )
        )
        return columns, rows

    def at(self, columns: Floats, rows: Floats) -> Floats:
        """The texture at places between its pixels, linearly."""
        return np.asarray(cv2.remap(self.padded, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))


def repeated_px(frame: tuple[int, int]) -> int:
    """How far a periodic texture is repeated past its edges, px, so that a frame (columns, rows) needs no wrap."""
    return int(np.hypot(*frame)) + ROOM


def tile_side(frame: tuple[int, int]) -> int:
    """Side of the texture for frames of (columns, rows): at least TILE, and no smaller than a frame."""
    return max(TILE, 1 << (max(frame) - 1).bit_length())


def tile_shape(frame: tuple[int, int]) -> tuple[int, int]:
    """Rows and columns of the same where it need not be square: of a frame much longer than wide only TILE across."""
    side = tile_side(frame)
    columns, rows = (side if length > TILE or side <= SQUARE else TILE for length in frame)
    return rows, columns
