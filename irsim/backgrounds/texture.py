"""Textures, and their place in the picture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.backgrounds.chart import Chart
from irsim.types import Floats

TILE = 1024
"""Side of a texture, px; it repeats beyond."""


@dataclass(frozen=True, eq=False)
class Tile:
    """A periodic texture on the chart's map; repeated past its edges so that a frame needs no wrap."""

    side: int
    padded: Floats
    phase: tuple[float, float]
    """Where the map's (0, 0) lies between texels: so that a camera at rest sees texels, unblurred by interpolation."""

    @classmethod
    def of(cls, texture: Floats, frame: tuple[int, int], psf_px: float) -> Tile:
        """A square texture (side, side), blurred by the optics, for frames of (columns, rows)."""
        margin = repeated_px(frame)
        columns, rows = frame
        phase = (columns - 1) / 2 % 1, (rows - 1) / 2 % 1  # (0, 0) is the frame's middle
        return cls(texture.shape[0], np.pad(_blurred(texture, psf_px), (0, margin), mode="wrap"), phase)

    def places(self, chart: Chart, shift_px: tuple[float, float]) -> tuple[Floats, Floats]:
        """(rows, cols) float32 each: column and row of the texture that each pixel sees."""
        u, v = chart.u - shift_px[0] + self.phase[0], chart.v - shift_px[1] + self.phase[1]
        # Whole periods are taken off before float32, whose steps would grow with distance.
        u = u - np.floor(u.min() / self.side) * self.side
        v = v - np.floor(v.min() / self.side) * self.side
        return chart.spread(u), chart.spread(v)

    def at(self, columns: Floats, rows: Floats) -> Floats:
        """The texture at places between its pixels, linearly."""
        return np.asarray(cv2.remap(self.padded, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))


def _blurred(texture: Floats, sigma_px: float) -> Floats:
    """A periodic texture after a Gaussian blur; its transform is exp(-2 pi^2 sigma^2 f^2)."""
    side = texture.shape[0]
    square = np.fft.fftfreq(side)[:, None] ** 2 + np.fft.rfftfreq(side)[None, :] ** 2
    passed = np.exp(-2 * np.pi**2 * sigma_px**2 * square)
    return np.fft.irfft2(np.fft.rfft2(texture) * passed, s=texture.shape).astype(np.float32)


def repeated_px(frame: tuple[int, int]) -> int:
    """How far a periodic texture is repeated past its edges, px, so that a frame (columns, rows) needs no wrap."""
    return int(np.hypot(*frame)) + 64


def tile_side(frame: tuple[int, int]) -> int:
    """Side of the texture for frames of (columns, rows): at least TILE, and no smaller than a frame."""
    return max(TILE, 1 << (max(frame) - 1).bit_length())
