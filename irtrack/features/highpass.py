"""High-pass filter by background prediction, which leaves a small target's contrast with its surroundings.

    residual = frame - background,  background = mean of the frame over a neighbourhood

Xue, Yuan, Xie 2011 (section 1.1, eq. 1) predict from a ring neighbourhood, the pixels nearest to (i + r cos theta,
j + r sin theta) for r = 0, 1 ... L and theta = 0, 2 pi / m ..., and only at the points of a grid; other pixels take the
nearest prediction. Peng, Zhou 1999 (their reference 12) predict every pixel from its whole n x n neighbourhood. The
paper leaves open L, m, the grid's step, the samples' weights (here equal, one for each (r, theta) and for the centre)
and the mapping of residuals to grey levels (here `HighPass`). The frame is mirrored at its edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, sqrt
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import MEDIAN_TO_SIGMA, Floats, Image
from irtrack._native import COMPILED, kernels
from irtrack.features.quantiser import contiguous

Singles = npt.NDArray[np.float32]
Kernel = Singles
"""Number of samples at each pixel of a neighbourhood, (2L+1, 2L+1). Sums of whole numbers are exact, so that a part
computed alone equals the part of the whole picture."""

Picture = npt.NDArray[np.uint8]

REACH = 8.0
"""Number of standard deviations of the residual from middle grey to white: a target of SCR 8 is just white. Chosen
here."""

ROUNDING = 1 / sqrt(12)
"""Standard deviation of rounding to whole counts, the least noise of any frame."""

DIRECT = 7
"""Side of the largest kernel, px, that OpenCV sums sample by sample on any machine, not by a Fourier transform."""


def ring_kernel(L: int, m: int, inner: int = 0) -> Kernel:
    """Return the samples (2L+1, 2L+1) of the ring neighbourhood of eq. 1, m on each radius.

    `inner` is the least radius, px, 0 in the paper; beyond half the target's size it excludes the target.
    """
    kernel = np.zeros((2 * L + 1, 2 * L + 1), np.float32)
    for r in range(inner, L + 1):
        for angle in [2 * pi * j / m for j in range(m)] if r > 0 else [0.0]:
            kernel[L + _nearest(r * sin(angle)), L + _nearest(r * cos(angle))] += 1
    return kernel


def full_kernel(L: int) -> Kernel:
    """Return the full neighbourhood, (2L+1, 2L+1) ones (Peng, Zhou 1999)."""
    return np.ones((2 * L + 1, 2 * L + 1), np.float32)


def predicted_background(pixels: Singles, kernel: Kernel, grid: int) -> Singles:
    """Return the predicted background of float32 pixels (rows, columns), counts.

    Of each grid x grid block the middle pixel is predicted (the upper left of the middle four). All other pixels take
    the nearest prediction.
    """
    predicted = cv2.filter2D(pixels, cv2.CV_32F, kernel / kernel.sum(), borderType=cv2.BORDER_REFLECT_101)
    nearest: Singles = _on_grid(predicted, grid).astype(np.float32, copy=False)
    return nearest


def _on_grid(sums: Any, grid: int) -> Any:
    if grid == 1:
        return sums
    rows, columns = sums.shape
    first = min((grid - 1) // 2, rows - 1), min((grid - 1) // 2, columns - 1)
    coarse = np.ascontiguousarray(sums[first[0] :: grid, first[1] :: grid])
    blocks = cv2.resize(coarse, None, fx=grid, fy=grid, interpolation=cv2.INTER_NEAREST)
    below, right = max(rows - blocks.shape[0], 0), max(columns - blocks.shape[1], 0)
    return cv2.copyMakeBorder(blocks, 0, below, 0, right, cv2.BORDER_REPLICATE)[:rows, :columns]


@dataclass(frozen=True, slots=True, eq=False)
class HighPass:
    """High-pass filter to 8-bit pictures: 128 + gain * residual, rounded and clipped.

    The gain, grey levels per count, is set once, so that histograms of different frames can be compared.
    """

    kernel: Kernel
    grid: int
    gain: float

    @classmethod
    def fitted(cls, image: Image, kernel: Kernel, grid: int) -> HighPass:
        """Return the filter whose gain maps `REACH` standard deviations of a first frame's residual to 128 grey levels.

        The deviation is estimated by the median absolute residual, which targets change little.
        """
        pixels = image.astype(np.float32)
        deviation = MEDIAN_TO_SIGMA * float(np.median(np.abs(pixels - predicted_background(pixels, kernel, grid))))
        return cls(kernel, grid, 128 / (REACH * max(deviation, ROUNDING)))

    def __call__(self, image: Image) -> Picture:
        """Return the high-passed picture (rows, columns) of a frame."""
        picture = np.empty(image.shape, np.uint8)
        return picture if self.write(image, (0, 0), picture) else self.full_picture(image)

    def view(self, image: Image) -> HighPassedFrame | Picture:
        """Return the picture computed part by part on demand; computed whole where predictions lie on a grid."""
        return HighPassedFrame(image, self) if self.grid == 1 else self(image)

    def write(self, image: Image, corner: tuple[int, int], picture: Picture) -> bool:
        """Compute the part of the picture at corner (left, top) by the C kernel; return False where it cannot."""
        return (
            COMPILED
            and self.grid == 1
            and kernels.high_pass(contiguous(image), self.kernel, self.gain, *corner, picture)
        )

    def full_picture(self, image: Image) -> Picture:
        """Return the whole picture, computed by array operations."""
        samples = float(self.kernel.sum())
        # float32 holds whole numbers below 2^24, and OpenCV sums many samples by a Fourier transform.
        exact = len(self.kernel) <= DIRECT and samples * np.iinfo(image.dtype).max < 2**24
        pixels: Floats = image.astype(np.float32 if exact else np.float64)
        sums = cv2.filter2D(pixels, -1, self.kernel, borderType=cv2.BORDER_REFLECT_101)
        levels: Singles = (samples * pixels - _on_grid(np.rint(sums), self.grid)).astype(np.float32, copy=False)
        levels *= np.float32(self.gain / samples)
        levels += 128
        np.rint(levels, out=levels)
        np.clip(levels, 0, 255, out=levels)
        return levels.astype(np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class HighPassedFrame:
    """High-passed picture of a frame, computed part by part on demand."""

    image: Image
    high_pass: HighPass

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)"""
        return self.image.shape[0], self.image.shape[1]

    def __getitem__(self, part: tuple[slice, slice]) -> Picture:
        """Return the part (rows, columns) of the picture inside the frame; both slices must have both ends."""
        rows, columns = part
        picture = np.empty((max(rows.stop - rows.start, 0), max(columns.stop - columns.start, 0)), np.uint8)
        if picture.size == 0 or self.high_pass.write(self.image, (columns.start, rows.start), picture):
            return picture
        reach = self.high_pass.kernel.shape[0] // 2
        top, left = max(rows.start - reach, 0), max(columns.start - reach, 0)
        around = self.high_pass.full_picture(self.image[top : rows.stop + reach, left : columns.stop + reach])
        picture[:] = around[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        return picture


def _nearest(value: float) -> int:
    """Return the nearest whole number; halves are rounded up on any machine, despite rounding errors."""
    return int(np.floor(value + 0.5 + 1e-9))
