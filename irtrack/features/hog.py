"""Histograms of oriented gradients of windows.

N. Dalal, B. Triggs, "Histograms of Oriented Gradients for Human Detection", CVPR 2005: central differences, 9 unsigned
orientations without interpolation, square cells, overlapping blocks of 2 x 2 cells, each normalised by L2-Hys. The
conventions are those of `skimage.feature.hog`: differences are 0 at a window's edge, and the vector runs over rows and
columns of blocks, rows and columns of cells, orientations.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from irsim.types import Floats
from irtrack._native import COMPILED, kernels
from irtrack.features.scaled_region import Picture

ORIENTATIONS = 9
BLOCK = 2
"""Side of a block, cells."""
MOST = 0.2
"""Value at which L2-Hys clips."""
EPS = 1e-5
"""Added to the norm of a block, as in `skimage.feature.hog`."""
_BOUNDS = np.array([(cos(pi * k / ORIENTATIONS), sin(pi * k / ORIENTATIONS)) for k in range(1, ORIENTATIONS)])
"""Directions between the orientations 0 .. 20, 20 .. 40 degrees, and so on."""


@dataclass(frozen=True, slots=True)
class HOG:
    """Layout of a window of columns x rows pixels in cells of `cell` x `cell` pixels."""

    columns: int
    rows: int
    cell: int

    @property
    def length(self) -> int:
        """Length of the vector."""
        blocks = (self.rows // self.cell - BLOCK + 1) * (self.columns // self.cell - BLOCK + 1)
        return blocks * BLOCK * BLOCK * ORIENTATIONS

    def vectors(self, pixels: Picture, places: Floats, spacing: Floats) -> Floats:
        """Return vectors (N, length) of windows in a picture.

        Windows have their centres at `places` (N, 2) and samples `spacing` (N, 2) apart, pixels of the picture, which
        is interpolated linearly; beyond it, its edge is repeated.
        """
        windows = np.concatenate([places, spacing], axis=1)
        if not COMPILED:
            return self._vectors(pixels, windows)
        vectors = np.empty((len(windows), self.length))
        kernels.hog_windows(pixels, windows, _BOUNDS, self.columns, self.rows, self.cell, vectors)
        return vectors

    def _vectors(self, pixels: Picture, windows: Floats) -> Floats:
        samples = sampled(pixels, windows, self.columns, self.rows)
        gx, gy = np.zeros_like(samples), np.zeros_like(samples)
        gx[:, :, 1:-1] = samples[:, :, 2:] - samples[:, :, :-2]
        gy[:, 1:-1] = samples[:, 2:] - samples[:, :-2]
        strength = np.sqrt(gx * gx + gy * gy)
        below = (gy < 0) | ((gy == 0) & (gx < 0))
        gx, gy = np.where(below, -gx, gx), np.where(below, -gy, gy)
        orientation = sum(((gy * c - gx * s >= 0) for c, s in _BOUNDS), np.zeros(gx.shape, np.intp))
        down, across = self.rows // self.cell, self.columns // self.cell
        cell = (np.arange(self.rows) // self.cell)[:, None] * across + np.arange(self.columns) // self.cell
        at = (np.arange(len(windows))[:, None, None] * down * across + cell) * ORIENTATIONS + orientation
        mass = np.bincount(at.ravel(), strength.ravel(), len(windows) * down * across * ORIENTATIONS)
        cells = mass.reshape(len(windows), down, across, ORIENTATIONS) / self.cell**2
        parts = [cells[:, i : down - 1 + i, j : across - 1 + j] for i in range(BLOCK) for j in range(BLOCK)]
        blocks = np.concatenate(parts, axis=-1)
        blocks = np.minimum(blocks / np.sqrt((blocks * blocks).sum(axis=-1, keepdims=True) + EPS**2), MOST)
        blocks = blocks / np.sqrt((blocks * blocks).sum(axis=-1, keepdims=True) + EPS**2)
        vectors: Floats = blocks.reshape(len(windows), -1)
        return vectors


def sampled(pixels: Picture, windows: Floats, columns: int, rows: int) -> Floats:
    """Return samples (N, rows, columns) of windows (N, 4): centre x, y and spacing x, y, pixels of the picture."""
    x = windows[:, 0, None] + windows[:, 2, None] * (np.arange(columns) - (columns - 1) / 2)
    y = windows[:, 1, None] + windows[:, 3, None] * (np.arange(rows) - (rows - 1) / 2)
    x0, fx = _nodes(x, pixels.shape[1])
    y0, fy = _nodes(y, pixels.shape[0])
    fx, fy, x0, y0 = fx[:, None], fy[:, :, None], x0[:, None], y0[:, :, None]
    values = pixels.astype(np.float64)
    upper = values[y0, x0] * (1 - fx) + values[y0, x0 + 1] * fx
    lower = values[y0 + 1, x0] * (1 - fx) + values[y0 + 1, x0 + 1] * fx
    samples: Floats = upper * (1 - fy) + lower * fy
    return samples


def _nodes(places: Floats, count: int) -> tuple[np.ndarray, Floats]:
    """Return the pixel before each position on an axis, and the share of the next one."""
    inside = np.minimum(np.maximum(places, 0), count - 1)
    first = np.minimum(inside.astype(np.intp), count - 2)
    return first, inside - first
