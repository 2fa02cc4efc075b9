"""Haar-like features of windows on integral images.

P. Viola, M. Jones, "Robust Real-Time Face Detection", IJCV 57(2), 2004, section 2: differences of the sums of 2, 3 or 4
neighbouring rectangles; with R. Lienhart, J. Maydt, "An Extended Set of Haar-like Features", ICIP 2002: a rectangle
against the one around it. Values are divided by the window's area and standard deviation, so that gain and offset do
not matter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.features.scaled_region import Picture

CORNERS = 9
"""Largest number of corners of a feature on the integral image."""
FLAT = 1e-6
"""Standard deviation of a window, counts, below which its features are 0."""

Rectangle = tuple[int, int, int, int, int]
"""Left, top, columns, rows, weight."""


@dataclass(frozen=True, slots=True, eq=False)
class HaarFeatures:
    """F features of a window of `side` x `side` pixels as sums over the integral image.

    x, y    (F, CORNERS) corners, pixels from the window's top-left one;  weights (F, CORNERS)
    """

    side: int
    x: npt.NDArray[np.int64]
    y: npt.NDArray[np.int64]
    weights: Floats

    @classmethod
    def of(cls, side: int, step: int) -> HaarFeatures:
        """Return all features whose rectangles have sides and places that are multiples of `step` px."""
        rows = [_corners(rectangles) for rectangles in _all_features(side, step)]
        table = np.array(rows, dtype=np.int64)
        return cls(side, table[:, :, 0], table[:, :, 1], table[:, :, 2].astype(np.float64))

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: npt.NDArray[np.int64]) -> HaarFeatures:
        """Return the features of the given indices."""
        return HaarFeatures(self.side, self.x[rows], self.y[rows], self.weights[rows])

    def values(self, integral: IntegralImage, corners: npt.NDArray[np.int64]) -> Floats:
        """Return values (N, F) of windows with their top-left pixels at `corners` (N, 2): column and row.

        Corners are moved to the nearest place at which the window lies inside the picture.
        """
        rows, columns = integral.sums.shape
        x = np.clip(corners[:, 0], 0, columns - 1 - self.side)
        y = np.clip(corners[:, 1], 0, rows - 1 - self.side)
        at = (y * columns + x)[:, None]
        found = integral.sums.ravel().take(at[:, :, None] + (self.y * columns + self.x)[None])
        raw = np.einsum("nfc,fc->nf", found, self.weights)
        deviation = integral.deviation(x, y, self.side)[:, None]
        scaled: Floats = np.where(deviation > FLAT, raw / (self.side**2 * np.maximum(deviation, FLAT)), 0.0)
        return scaled


@dataclass(frozen=True, slots=True, eq=False)
class IntegralImage:
    """Sums (R + 1, C + 1) of the pixels above and left of each corner, and of their squares."""

    sums: Floats
    squares: Floats

    @classmethod
    def of(cls, pixels: Picture) -> IntegralImage:
        """Return the sums of a picture less its mean, so that differences of squares keep their precision."""
        centred = pixels - pixels.mean(dtype=np.float64)
        sums, squares = cv2.integral2(centred.astype(np.float64), sdepth=cv2.CV_64F, sqdepth=cv2.CV_64F)
        return cls(np.asarray(sums, np.float64), np.asarray(squares, np.float64))

    def deviation(self, x: npt.NDArray[np.int64], y: npt.NDArray[np.int64], side: int) -> Floats:
        """Return the standard deviations (N,) of windows inside the picture, counts."""
        mean, square = (
            (table[y + side, x + side] - table[y, x + side] - table[y + side, x] + table[y, x]) / side**2
            for table in (self.sums, self.squares)
        )
        deviation: Floats = np.sqrt(np.maximum(square - mean * mean, 0))
        return deviation


def _all_features(side: int, step: int) -> Iterator[list[Rectangle]]:
    """Yield the rectangles of every feature."""
    for w in range(step, side + 1, step):
        for h in range(step, side + 1, step):
            for x in range(0, side - w + 1, step):
                for y in range(0, side - h + 1, step):
                    yield from _features_at(side, x, y, w, h)


def _features_at(side: int, x: int, y: int, w: int, h: int) -> Iterator[list[Rectangle]]:
    """Yield the features whose first rectangle has its top-left pixel at (x, y) and w x h px."""
    right, bottom = x + w, y + h
    if right + w <= side:
        yield [(x, y, w, h, -1), (right, y, w, h, 1)]
    if bottom + h <= side:
        yield [(x, y, w, h, -1), (x, bottom, w, h, 1)]
    if right + 2 * w <= side:
        yield [(x, y, w, h, -1), (right, y, w, h, 2), (right + w, y, w, h, -1)]
    if bottom + 2 * h <= side:
        yield [(x, y, w, h, -1), (x, bottom, w, h, 2), (x, bottom + h, w, h, -1)]
    if right + w <= side and bottom + h <= side:
        yield [(x, y, w, h, 1), (right, y, w, h, -1), (x, bottom, w, h, -1), (right, bottom, w, h, 1)]
    if w % 3 == 0 and h % 3 == 0:
        yield [(x, y, w, h, -1), (x + w // 3, y + h // 3, w // 3, h // 3, 9)]


def _corners(rectangles: list[Rectangle]) -> list[tuple[int, int, int]]:
    """Return the corners (x, y, weight) of rectangles, those that cancel left out, filled up with weights 0."""
    weights: dict[tuple[int, int], int] = {}
    for x, y, w, h, weight in rectangles:
        for place, sign in (((x, y), 1), ((x + w, y), -1), ((x, y + h), -1), ((x + w, y + h), 1)):
            weights[place] = weights.get(place, 0) + sign * weight
    found = [(x, y, weight) for (x, y), weight in weights.items() if weight]
    return found + [(0, 0, 0)] * (CORNERS - len(found))
